# Small image libraries that the SDK links: maq_webp decodes the sprites of stub:people, maq_turbojpeg the frames of
# cameras that send JPEG. The first becomes a part of libmaquette.so, so that an app has one library less to ship.
function(_maq_find_codec target header names package)
  find_path(${target}_INCLUDE_DIR ${header})
  find_library(${target}_FILE NAMES ${names})
  mark_as_advanced(${target}_INCLUDE_DIR ${target}_FILE)
  if(NOT ${target}_INCLUDE_DIR OR NOT ${target}_FILE)
    message(FATAL_ERROR "${header} or its library (${names}) was not found. On Debian install ${package}; "
      "elsewhere set ${target}_INCLUDE_DIR and ${target}_FILE.")
  endif()
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION "${${target}_FILE}"
    INTERFACE_INCLUDE_DIRECTORIES "${${target}_INCLUDE_DIR}")
endfunction()

_maq_find_codec(maq_webp webp/decode.h libwebp.a libwebp-dev)
_maq_find_codec(maq_turbojpeg turbojpeg.h turbojpeg libturbojpeg0-dev)
