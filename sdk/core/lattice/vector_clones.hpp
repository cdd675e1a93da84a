#pragma once
// TANDEM_VECTOR_CLONES stands before a function of plain integer loops. On x86-64 the compiler then also
// makes a copy for AVX2, which is chosen at load time, because plain SSE2 lacks the minimum, maximum and
// product of 32-bit integers. Integers give the same bits in every copy. It is off under sanitizers, because
// the choice would run before their start-up, and in a portable build.

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(TANDEM_SANITIZED) && !defined(TANDEM_PORTABLE)
#define TANDEM_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define TANDEM_VECTOR_CLONES
#endif
