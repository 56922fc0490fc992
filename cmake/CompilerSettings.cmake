# Warnings and sanitizers, as one interface target that every target of this project links.
add_library(maq_compiler_settings INTERFACE)
target_compile_options(maq_compiler_settings INTERFACE
  -Wall -Wextra -Wpedantic -Wshadow -Wconversion -Wno-sign-conversion -fvisibility=hidden
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
