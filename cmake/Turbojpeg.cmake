# maq_turbojpeg: libjpeg-turbo, which decodes JPEG images: photos, frames of cameras, the sprites of stub:people.
find_path(maq_turbojpeg_INCLUDE_DIR turbojpeg.h)
find_library(maq_turbojpeg_FILE turbojpeg)
mark_as_advanced(maq_turbojpeg_INCLUDE_DIR maq_turbojpeg_FILE)
if(NOT maq_turbojpeg_INCLUDE_DIR OR NOT maq_turbojpeg_FILE)
  message(FATAL_ERROR "turbojpeg.h or its library (turbojpeg) was not found. On Debian install libturbojpeg0-dev; "
    "elsewhere set maq_turbojpeg_INCLUDE_DIR and maq_turbojpeg_FILE.")
endif()
add_library(maq_turbojpeg UNKNOWN IMPORTED GLOBAL)
set_target_properties(maq_turbojpeg PROPERTIES IMPORTED_LOCATION "${maq_turbojpeg_FILE}"
  INTERFACE_INCLUDE_DIRECTORIES "${maq_turbojpeg_INCLUDE_DIR}")
