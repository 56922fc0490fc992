# OpenCV for the native tests and benchmarks, as a second opinion on images; what is shipped does without.
# Targets opencv_core, opencv_imgproc, opencv_imgcodecs and opencv_videoio.
# Taken from OpenCV's own CMake package where there is one; Debian ships that only with the
# complete libopencv-dev, while the -dev packages of the modules, a fifth of its size, have headers and libraries only.
find_package(OpenCV 4.5 CONFIG QUIET COMPONENTS core imgproc imgcodecs videoio)
if(NOT OpenCV_FOUND)
  find_path(MAQ_OPENCV_INCLUDE_DIR opencv2/core/version.hpp PATH_SUFFIXES opencv4)
  if(NOT MAQ_OPENCV_INCLUDE_DIR)
    message(FATAL_ERROR "OpenCV 4.5 or newer was not found. On Debian install "
      "libopencv-core-dev libopencv-imgproc-dev libopencv-imgcodecs-dev libopencv-videoio-dev; "
      "elsewhere set OpenCV_DIR to the folder of OpenCVConfig.cmake.")
  endif()
  file(STRINGS "${MAQ_OPENCV_INCLUDE_DIR}/opencv2/core/version.hpp" _opencv_version_lines
    REGEX "#define CV_VERSION_(MAJOR|MINOR|REVISION) ")
  string(REGEX REPLACE ".*MAJOR +([0-9]+).*MINOR +([0-9]+).*REVISION +([0-9]+).*" "\\1.\\2.\\3"
    OpenCV_VERSION "${_opencv_version_lines}")
  if(OpenCV_VERSION VERSION_LESS 4.5)
    message(FATAL_ERROR "OpenCV ${OpenCV_VERSION} in ${MAQ_OPENCV_INCLUDE_DIR} is too old; 4.5 is needed.")
  endif()
  foreach(_module core imgproc imgcodecs videoio)
    find_library(MAQ_OPENCV_${_module} opencv_${_module} REQUIRED)
    add_library(opencv_${_module} UNKNOWN IMPORTED)
    set_target_properties(opencv_${_module} PROPERTIES IMPORTED_LOCATION "${MAQ_OPENCV_${_module}}"
      INTERFACE_INCLUDE_DIRECTORIES "${MAQ_OPENCV_INCLUDE_DIR}")
  endforeach()
endif()
