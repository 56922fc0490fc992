# xxHash, as maq_xxhash: a header, whose code becomes part of the SDK.
find_path(MAQ_XXHASH_INCLUDE_DIR xxhash.h)
if(NOT MAQ_XXHASH_INCLUDE_DIR)
  message(FATAL_ERROR "xxhash.h was not found. On Debian install libxxhash-dev; elsewhere set MAQ_XXHASH_INCLUDE_DIR.")
endif()
add_library(maq_xxhash INTERFACE)
target_include_directories(maq_xxhash SYSTEM INTERFACE "${MAQ_XXHASH_INCLUDE_DIR}")
target_compile_definitions(maq_xxhash INTERFACE XXH_INLINE_ALL)
# Sanitizer builds optimise less (-Og) than its functions that must be inlined need.
if(MAQ_SANITIZE)
  target_compile_definitions(maq_xxhash INTERFACE XXH_NO_INLINE_HINTS=1)
endif()
