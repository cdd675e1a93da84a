// The C library of WASI writes messages of aborts to a system that a browser does not have. With these
// functions in place of its own, the module imports nothing of WASI.

#include <wasi/api.h>

#include <cstddef>

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
