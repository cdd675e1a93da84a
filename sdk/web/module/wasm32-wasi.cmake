# Debian's clang 14 for WebAssembly: packages [web] of deploy/packages.
# Flags of the environment are for the machine that builds: those of a Debian package ask for a stack protector, which is not there.
foreach(flags CFLAGS CPPFLAGS CXXFLAGS LDFLAGS)
  set(ENV{${flags}} "")
endforeach()
set(CMAKE_SYSTEM_NAME Generic)
set(CMAKE_SYSTEM_PROCESSOR wasm32)
set(CMAKE_C_COMPILER clang-14)
set(CMAKE_CXX_COMPILER clang++-14)
set(CMAKE_C_COMPILER_TARGET wasm32-wasi)
set(CMAKE_CXX_COMPILER_TARGET wasm32-wasi)
# The linker sees the whole program, and drops virtual functions that nobody calls: all of encoding. A third of the size.
set(CMAKE_CXX_FLAGS_INIT
  "-fno-exceptions -fno-rtti -flto -fvisibility=hidden -fwhole-program-vtables -fvirtual-function-elimination")
set(CMAKE_PREFIX_PATH /usr)  # libraries that are headers alone
