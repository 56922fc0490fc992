# Toolchain: Android, as a check where there is no NDK: Debian's clang 14 with what scripts/android/sysroot.sh brings.
# What it builds compiles and links as for Android, and was never run. Needs ANDROID_ABI, arm64-v8a or x86_64.
set(CMAKE_SYSTEM_NAME Android)
set(CMAKE_SYSTEM_VERSION 1)  # CMake leaves everything to this file
set(ANDROID TRUE)
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES ANDROID_ABI)
set(CMAKE_ANDROID_ARCH_ABI "${ANDROID_ABI}")

if(ANDROID_ABI STREQUAL "arm64-v8a")
  set(CMAKE_SYSTEM_PROCESSOR aarch64)
elseif(ANDROID_ABI STREQUAL "x86_64")
  set(CMAKE_SYSTEM_PROCESSOR x86_64)
else()
  message(FATAL_ERROR "ANDROID_ABI is '${ANDROID_ABI}', but arm64-v8a or x86_64 is expected.")
endif()
set(_target ${CMAKE_SYSTEM_PROCESSOR}-linux-android26)

cmake_path(SET MAQ_ANDROID_SYSROOT NORMALIZE "${CMAKE_CURRENT_LIST_DIR}/../.deps/android-sysroot")
if(NOT EXISTS "${MAQ_ANDROID_SYSROOT}/.ready")
  message(FATAL_ERROR "${MAQ_ANDROID_SYSROOT} is not there yet. Run scripts/android/sysroot.sh.")
endif()
set(CMAKE_FIND_ROOT_PATH "${MAQ_ANDROID_SYSROOT}")
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

set(CMAKE_C_COMPILER clang-14)
set(CMAKE_CXX_COMPILER clang++-14)
set(CMAKE_C_COMPILER_TARGET ${_target})
set(CMAKE_CXX_COMPILER_TARGET ${_target})

# musl's headers name a few things otherwise than Android's own.
set(_defines "-D__errno_location=__errno -D__mbstate_t=mbstate_t")
set(_c_headers)
set(_musl ${CMAKE_SYSTEM_PROCESSOR}-linux-musl)
set(_any aarch64-linux-any)
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  set(_any x86-linux-any)
endif()
foreach(_folder ${_musl} generic-musl ${_any} any-linux-any android)
  string(APPEND _c_headers " -isystem ${MAQ_ANDROID_SYSROOT}/include/${_folder}")
endforeach()
set(_common "-fPIC -nostdlibinc -Wno-unused-command-line-argument ${_defines}")
set(CMAKE_C_FLAGS_INIT "${_common} ${_c_headers}")
string(CONCAT CMAKE_CXX_FLAGS_INIT
  "${_common} -nostdinc++ -D_LIBCPP_ABI_NAMESPACE=__ndk1 -D_LIBCPP_HAS_MUSL_LIBC "
  "-include ${CMAKE_CURRENT_LIST_DIR}/android-check.h -isystem /usr/lib/llvm-14/include/c++/v1 ${_c_headers}")

string(CONCAT _link "-fuse-ld=lld-14 -nostdlib -L${MAQ_ANDROID_SYSROOT}/lib/${ANDROID_ABI} "
  "-Wl,--as-needed -Wl,-z,defs -Wl,--allow-shlib-undefined -Wl,-z,max-page-size=16384")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "${_link}")
set(CMAKE_EXE_LINKER_FLAGS_INIT "${_link}")
set(CMAKE_C_STANDARD_LIBRARIES "-lc -lm -ldl")
set(CMAKE_CXX_STANDARD_LIBRARIES "-lc++_shared -lc -lm -ldl")
if(CMAKE_SYSTEM_PROCESSOR STREQUAL "x86_64")
  # __builtin_cpu_supports() needs a part of the compiler, which the NDK links in; here it is that of GCC.
  execute_process(COMMAND gcc -print-libgcc-file-name OUTPUT_VARIABLE _libgcc OUTPUT_STRIP_TRAILING_WHITESPACE
    COMMAND_ERROR_IS_FATAL ANY)
  string(APPEND CMAKE_CXX_STANDARD_LIBRARIES " ${_libgcc}")
endif()
