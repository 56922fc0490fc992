# Toolchain: packages for Linux systems with glibc 2.28 or newer, of MAQ_WHEEL_MACHINE (x86_64 or aarch64). Codecs and the
# C++ library are inside; scripts/wheel/prepare.sh makes both folders. The compiler, and so the results, are those of the
# release build.
list(APPEND CMAKE_TRY_COMPILE_PLATFORM_VARIABLES MAQ_WHEEL_MACHINE)
if(MAQ_WHEEL_MACHINE STREQUAL "aarch64" AND NOT CMAKE_HOST_SYSTEM_PROCESSOR STREQUAL "aarch64")
  include("${CMAKE_CURRENT_LIST_DIR}/aarch64.cmake")
endif()
set(_deps "${CMAKE_CURRENT_LIST_DIR}/../.deps")
cmake_path(NORMAL_PATH _deps)
set(_glibc "${_deps}/glibc-2.28-${MAQ_WHEEL_MACHINE}")
if(NOT EXISTS "${_glibc}/start.o" OR NOT EXISTS "${_deps}/codecs-${MAQ_WHEEL_MACHINE}/.ready")
  message(FATAL_ERROR "${_glibc} or the codecs are not there. Run scripts/wheel/prepare.sh ${MAQ_WHEEL_MACHINE}.")
endif()
set(MAQ_CODECS_DIR "${_deps}/codecs-${MAQ_WHEEL_MACHINE}" CACHE PATH "")
set(_flags "-static-libstdc++ -L${_glibc} -Wl,--no-as-needed -lpthread -ldl -lm -Wl,--as-needed ${_glibc}/compat.o")
set(CMAKE_CXX_STANDARD_LIBRARIES_INIT "-lld")
string(APPEND _flags " -Wl,--exclude-libs,ALL -Wl,--allow-shlib-undefined")
set(CMAKE_SHARED_LINKER_FLAGS_INIT "${_flags}")
set(CMAKE_EXE_LINKER_FLAGS_INIT "-nostartfiles ${_glibc}/start.o ${_flags}")
