# LIBRARY must not be larger than LIMIT_BYTES.
get_filename_component(file "${LIBRARY}" REALPATH)
file(SIZE "${file}" bytes)
message(STATUS "${file}: ${bytes} bytes of ${LIMIT_BYTES}")
if(bytes GREATER LIMIT_BYTES)
  message(FATAL_ERROR "The library has grown over ${LIMIT_BYTES} bytes.")
endif()
