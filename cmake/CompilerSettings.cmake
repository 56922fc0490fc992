# Warnings, hardening and sanitizers, as one interface target that every target of this project links.
#
# -ffp-contract=off: where a processor can multiply and add at once (aarch64), compilers use that, and it rounds once
# instead of twice. A last bit of the networks' input then changes, int8 layers round some values to the other side, and
# in the end 0.8 % of the labels of a photo are others than on x86-64 (benchmarks.processors.label_agreement).
add_library(maq_compiler_settings INTERFACE)
target_compile_options(maq_compiler_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -fvisibility=hidden -ffp-contract=off
  $<$<COMPILE_LANGUAGE:CXX>:-fvisibility-inlines-hidden;-Wnon-virtual-dtor;-Woverloaded-virtual>
  $<$<BOOL:${MAQ_WARNINGS_AS_ERRORS}>:-Werror>
  $<$<CONFIG:Release>:-ffunction-sections;-fdata-sections>)
target_link_options(maq_compiler_settings INTERFACE $<$<CONFIG:Release>:-Wl,--gc-sections>)

# What reads files and cameras of strangers takes what compilers and linkers offer against errors that it may still have.
# _FORTIFY_SOURCE needs optimisation, and takes from sanitizers what they would report; a level that the C library does
# not have is a warning there. Addresses known only at load time: position-independent programs, too.
include(CheckCompilerFlag)
include(CheckCXXSourceCompiles)
include(CheckPIESupported)
target_compile_options(maq_compiler_settings INTERFACE -fstack-protector-strong)
if(WIN32)
  target_link_options(maq_compiler_settings INTERFACE -fstack-protector-strong -Wl,--nxcompat -Wl,--dynamicbase -Wl,--high-entropy-va)
else()
  target_link_options(maq_compiler_settings INTERFACE -Wl,-z,relro -Wl,-z,now -Wl,-z,noexecstack)
endif()
set(CMAKE_POSITION_INDEPENDENT_CODE ON)
check_pie_supported(LANGUAGES C CXX)
# Where a jump or a return may lead: x86-64 CET, aarch64 BTI and PAC. Clang warns about a flag of another processor.
set(CMAKE_REQUIRED_FLAGS -Werror)
foreach(_flag -fcf-protection=full -mbranch-protection=standard)
  string(MAKE_C_IDENTIFIER "MAQ_HAVE${_flag}" _have)
  check_compiler_flag(CXX ${_flag} ${_have})
  if(${_have})
    target_compile_options(maq_compiler_settings INTERFACE ${_flag})
  endif()
endforeach()
unset(CMAKE_REQUIRED_FLAGS)
if(NOT MAQ_SANITIZE)
  set(CMAKE_REQUIRED_FLAGS "-O2 -Werror -U_FORTIFY_SOURCE -D_FORTIFY_SOURCE=3")
  check_cxx_source_compiles("#include <cstring>\nint main() { return 0; }" MAQ_HAVE_FORTIFY_SOURCE_3)
  unset(CMAKE_REQUIRED_FLAGS)
  set(_fortify 2)
  if(MAQ_HAVE_FORTIFY_SOURCE_3)
    set(_fortify 3)
  endif()
  target_compile_options(maq_compiler_settings INTERFACE
    "$<$<CONFIG:Release,RelWithDebInfo,MinSizeRel>:-U_FORTIFY_SOURCE;-D_FORTIFY_SOURCE=${_fortify}>")
endif()

# Without the checks of null pointers before every access, a quarter of the compile time: AddressSanitizer reports each
# access through one.
if(MAQ_SANITIZE STREQUAL "address")
  set(_maq_sanitizers -fsanitize=address,undefined -fno-sanitize=null -fno-sanitize-recover=all -fno-omit-frame-pointer)
elseif(MAQ_SANITIZE STREQUAL "thread")
  set(_maq_sanitizers -fsanitize=thread)
elseif(NOT MAQ_SANITIZE STREQUAL "")
  message(FATAL_ERROR "MAQ_SANITIZE is '${MAQ_SANITIZE}'; use address, thread or nothing.")
endif()
if(_maq_sanitizers)
  target_compile_options(maq_compiler_settings INTERFACE ${_maq_sanitizers})
  target_link_options(maq_compiler_settings INTERFACE ${_maq_sanitizers})
endif()
