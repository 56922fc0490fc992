# Small image libraries that the SDK links: maq_webp decodes the sprites of stub:people, maq_turbojpeg the frames of
# cameras that send JPEG.
function(_maq_find_codec target header library package)
  find_path(${target}_INCLUDE_DIR ${header})
  find_library(${target}_LIBRARY ${library})
  if(NOT ${target}_INCLUDE_DIR OR NOT ${target}_LIBRARY)
    message(FATAL_ERROR "${header} or lib${library} was not found. On Debian install ${package}; "
      "elsewhere set ${target}_INCLUDE_DIR and ${target}_LIBRARY.")
  endif()
  add_library(${target} UNKNOWN IMPORTED GLOBAL)
  set_target_properties(${target} PROPERTIES IMPORTED_LOCATION "${${target}_LIBRARY}"
    INTERFACE_INCLUDE_DIRECTORIES "${${target}_INCLUDE_DIR}")
endfunction()

_maq_find_codec(maq_webp webp/decode.h webp libwebp-dev)
_maq_find_codec(maq_turbojpeg turbojpeg.h turbojpeg libturbojpeg0-dev)
