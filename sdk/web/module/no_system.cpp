// Functions of a system that libraries for WASI expect and a browser does not have.

#include <wasi/api.h>

#include <cstddef>
#include <cstdlib>
#include <new>

// Without exceptions the library's own returns null where memory ran out, and null is an address like any
// other here.
void* operator new(std::size_t size) {
  void* const memory = std::malloc(size);
  if (memory == nullptr) __builtin_trap();
  return memory;
}
void operator delete(void* memory) noexcept { std::free(memory); }

// The C library writes messages of aborts. With these functions in place of its own, the module imports
// nothing of WASI.

extern "C" {

__wasi_errno_t __wasi_fd_close(__wasi_fd_t /*file*/) { return __WASI_ERRNO_BADF; }

__wasi_errno_t __wasi_fd_seek(__wasi_fd_t /*file*/, __wasi_filedelta_t /*offset*/, __wasi_whence_t /*whence*/,
                              __wasi_filesize_t* /*position*/) {
  return __WASI_ERRNO_BADF;
}

__wasi_errno_t __wasi_fd_write(__wasi_fd_t /*file*/, const __wasi_ciovec_t* /*from*/, std::size_t /*count*/,
                               __wasi_size_t* /*written*/) {
  return __WASI_ERRNO_BADF;
}

}  // extern "C"
