#pragma once
// TANDEM_VECTOR_CLONES before a function of plain integer loops: on x86-64 the compiler also makes a copy of
// it for AVX2, chosen at load time, because plain SSE2 lacks the minimum, maximum and product of 32-bit
// integers. Integers, so every copy gives the same bits. Not under sanitizers, whose start-up the choice
// would precede, and not in a portable build.

#if defined(__x86_64__) && defined(__gnu_linux__) && !defined(TANDEM_SANITIZED) && !defined(TANDEM_PORTABLE)
#define TANDEM_VECTOR_CLONES __attribute__((target_clones("avx2", "default")))
#else
#define TANDEM_VECTOR_CLONES
#endif
