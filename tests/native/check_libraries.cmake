# Fails when LIBRARY needs other shared libraries than the C and C++ runtimes and codecs (cmake/Codecs.cmake), for
# `cmake -DREADELF=… -DLIBRARY=… -P`.
set(allowed "^(libc|libm|libdl|librt|libpthread|libgcc_s|libstdc\\+\\+|libturbojpeg|libpng16|libwebp|libvpx|libz|ld-linux[-a-z0-9_]*)\\.so(\\.[0-9]+)*$")
execute_process(COMMAND "${READELF}" -d "${LIBRARY}" OUTPUT_VARIABLE sections RESULT_VARIABLE result)
if(result)
  message(FATAL_ERROR "${READELF} -d ${LIBRARY} failed (${result}).")
endif()
string(REGEX MATCHALL "\\(NEEDED\\)[^\n]*\\[[^]\n]*\\]" lines "${sections}")
if(NOT lines)
  message(FATAL_ERROR "${LIBRARY} needs no library at all; is it ${READELF}'s output that is not understood?\n${sections}")
endif()
foreach(line ${lines})
  string(REGEX REPLACE ".*\\[(.*)\\]" "\\1" name "${line}")
  if(NOT name MATCHES "${allowed}")
    message(SEND_ERROR "${LIBRARY} needs ${name}, which an app would have to ship. Link it to a library that is opened "
      "at run time (src/core/module.h), or as an archive.")
  endif()
endforeach()
