# Toolchain: aarch64 Linux, by Debian's cross compiler (g++-aarch64-linux-gnu), against the arm64 packages that
# scripts/aarch64-sysroot.sh unpacks. Programs run under qemu-aarch64 (qemu-user).
set(CMAKE_SYSTEM_NAME Linux)
set(CMAKE_SYSTEM_PROCESSOR aarch64)
set(CMAKE_C_COMPILER aarch64-linux-gnu-gcc)
set(CMAKE_CXX_COMPILER aarch64-linux-gnu-g++)

set(MAQ_AARCH64_SYSROOT "${CMAKE_CURRENT_LIST_DIR}/../.deps/aarch64-sysroot")
cmake_path(NORMAL_PATH MAQ_AARCH64_SYSROOT)
if(NOT EXISTS "${MAQ_AARCH64_SYSROOT}/.ready")
  message(FATAL_ERROR "${MAQ_AARCH64_SYSROOT} is not there yet. Run scripts/aarch64-sysroot.sh.")
endif()

# No CMAKE_SYSROOT: the C and C++ libraries to build with are the cross compiler's own, those to run with are in the
# sysroot, of the same Debian release.
set(CMAKE_FIND_ROOT_PATH "${MAQ_AARCH64_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)
# Where the linker finds what OpenCV's libraries need in turn.
set(_rpath_links)
foreach(_folder usr/lib/aarch64-linux-gnu usr/lib lib/aarch64-linux-gnu)
  string(APPEND _rpath_links " -Wl,-rpath-link,${MAQ_AARCH64_SYSROOT}/${_folder}")
endforeach()
set(CMAKE_EXE_LINKER_FLAGS_INIT "${_rpath_links}")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "${_rpath_links}")

set(CMAKE_CROSSCOMPILING_EMULATOR "qemu-aarch64;-L;${MAQ_AARCH64_SYSROOT}")
