# Toolchain: Windows on x86-64, by Debian's MinGW-w64 (scripts/windows/prepare.sh makes the folders). Its runtime and the
# codecs are inside each program and library. Programs run under Wine.
set(CMAKE_SYSTEM_NAME Windows)
set(CMAKE_SYSTEM_PROCESSOR x86_64)
set(CMAKE_C_COMPILER x86_64-w64-mingw32-gcc-posix)
set(CMAKE_CXX_COMPILER x86_64-w64-mingw32-g++-posix)
set(CMAKE_RC_COMPILER x86_64-w64-mingw32-windres)

set(_deps "${CMAKE_CURRENT_LIST_DIR}/../.deps")
cmake_path(NORMAL_PATH _deps)
if(NOT EXISTS "${_deps}/windows-headers/.ready" OR NOT EXISTS "${_deps}/codecs-windows-x86_64/.ready")
  message(FATAL_ERROR "${_deps}/windows-headers or the codecs are not there. Run scripts/windows/prepare.sh.")
endif()
set(MAQ_CODECS_DIR "${_deps}/codecs-windows-x86_64" CACHE PATH "")

set(CMAKE_FIND_ROOT_PATH "${_deps}/windows-headers" /usr/x86_64-w64-mingw32)
set(CMAKE_FIND_ROOT_PATH_MODE_PROGRAM NEVER)
set(CMAKE_FIND_ROOT_PATH_MODE_LIBRARY ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_INCLUDE ONLY)
set(CMAKE_FIND_ROOT_PATH_MODE_PACKAGE ONLY)

# Windows 10. Sizes of files have 64 bits. The names of POSIX and M_PI, which strict C++ hides.
set(_flags "-D_WIN32_WINNT=0x0A00 -DWIN32_LEAN_AND_MEAN -DNOMINMAX -D_FILE_OFFSET_BITS=64 -D_USE_MATH_DEFINES -D_POSIX")
set(CMAKE_C_FLAGS_INIT "${_flags}")
set(CMAKE_CXX_FLAGS_INIT "${_flags}")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "-static")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-static")
set(CMAKE_CROSSCOMPILING_EMULATOR wine64)
