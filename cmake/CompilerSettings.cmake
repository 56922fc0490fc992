# Warnings and sanitizers, as one interface target that every target of this project links.
#
# -ffp-contract=off: where a processor can multiply and add at once (aarch64), compilers use that, and it rounds once
# instead of twice. A last bit of the networks' input then changes, int8 layers round some values to the other side, and
# in the end 0.8 % of the labels of a photo are others than on x86-64 (benchmarks.label_agreement).
add_library(maq_compiler_settings INTERFACE)
target_compile_options(maq_compiler_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -fvisibility=hidden -ffp-contract=off
  $<$<COMPILE_LANGUAGE:CXX>:-fvisibility-inlines-hidden;-Wnon-virtual-dtor;-Woverloaded-virtual>
  $<$<BOOL:${MAQ_WARNINGS_AS_ERRORS}>:-Werror>
  $<$<CONFIG:Release>:-ffunction-sections;-fdata-sections>)
target_link_options(maq_compiler_settings INTERFACE $<$<CONFIG:Release>:-Wl,--gc-sections>)

if(MAQ_SANITIZE STREQUAL "address")
  set(_maq_sanitizers -fsanitize=address,undefined -fno-sanitize-recover=all -fno-omit-frame-pointer)
elseif(MAQ_SANITIZE STREQUAL "thread")
  set(_maq_sanitizers -fsanitize=thread)
elseif(NOT MAQ_SANITIZE STREQUAL "")
  message(FATAL_ERROR "MAQ_SANITIZE is '${MAQ_SANITIZE}'; use address, thread or nothing.")
endif()
if(_maq_sanitizers)
  target_compile_options(maq_compiler_settings INTERFACE ${_maq_sanitizers})
  target_link_options(maq_compiler_settings INTERFACE ${_maq_sanitizers})
endif()
