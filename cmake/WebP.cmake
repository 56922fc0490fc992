# libwebp, which decodes the sprites of stub:people, as target maq_webp.
find_path(MAQ_WEBP_INCLUDE_DIR webp/decode.h)
find_library(MAQ_WEBP_LIBRARY webp)
if(NOT MAQ_WEBP_INCLUDE_DIR OR NOT MAQ_WEBP_LIBRARY)
  message(FATAL_ERROR "libwebp was not found. On Debian install libwebp-dev; "
    "elsewhere set MAQ_WEBP_INCLUDE_DIR and MAQ_WEBP_LIBRARY.")
endif()
add_library(maq_webp UNKNOWN IMPORTED)
set_target_properties(maq_webp PROPERTIES IMPORTED_LOCATION "${MAQ_WEBP_LIBRARY}"
  INTERFACE_INCLUDE_DIRECTORIES "${MAQ_WEBP_INCLUDE_DIR}")
