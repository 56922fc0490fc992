# ONNX Runtime, headers and shared library. The SDK opens the library itself at run time, so nothing links it here.
#
# Sets MAQ_ONNXRUNTIME_LIBRARY (a file), MAQ_ONNXRUNTIME_SONAME and the interface target maq_onnxruntime_headers, from
#   MAQ_ONNXRUNTIME_DIR, when that is given: an unpacked release;
#   else, with MAQ_FETCH_ONNXRUNTIME, the release below, fetched once into MAQ_DEPS_DIR by the ordinary package clients
#     and checked against its SHA-256; binaries for Linux from 1.29.0 on send telemetry, 1.26 to 1.28 do not;
#   else the target onnxruntime::onnxruntime of the app that this build is a part of, or of a package (onnxruntimeConfig),
#     or the header and the library where the system keeps such files.
set(MAQ_ONNXRUNTIME_VERSION 1.26.0)
set(_ort_min_api 24)  # of headers: kNewerApiVersion in sdk/src/nn/onnxruntime_library.cpp; the library may be 1.20

# The npm package repacks the official Android archive (which has the C headers and every Android ABI) and the official
# Linux x86-64 library; the aarch64 library is only in the official jar, which is fetched for that target alone.
set(_ort_npm_name com.github.asus4.onnxruntime)
set(_ort_npm_version 0.4.8)
set(_ort_npm_sha256 007a59a954d2161ffb1b3977a649c7945ee37bf30ad493891d4252c02e9536a4)
set(_ort_jar_coordinates com.microsoft.onnxruntime:onnxruntime:${MAQ_ONNXRUNTIME_VERSION})
set(_ort_jar_sha256 cf5a48c6f5d07b15f10634b80433ddce8f5892662b1a122bbbc0907f4f442c60)

# Runs a package client; `what` names what it fetches.
function(_maq_fetch what)
  file(MAKE_DIRECTORY "${MAQ_DEPS_DIR}")
  execute_process(COMMAND ${ARGN} OUTPUT_QUIET ERROR_VARIABLE error RESULT_VARIABLE result)
  if(result)
    message(FATAL_ERROR "${what} could not be fetched (${result}). Check the network, or set MAQ_ONNXRUNTIME_DIR to "
      "an ONNX Runtime ${MAQ_ONNXRUNTIME_VERSION} of your own.\n${error}")
  endif()
endfunction()

function(_maq_check_sha256 file expected)
  file(SHA256 "${file}" actual)
  if(NOT actual STREQUAL expected)
    message(FATAL_ERROR "${file} has SHA-256 ${actual}, but ${expected} is expected. "
      "Remove the file so that it is fetched again, or set MAQ_ONNXRUNTIME_DIR to an ONNX Runtime of your own.")
  endif()
endfunction()

function(_maq_fetch_npm_package archive)
  if(NOT EXISTS "${archive}")
    find_program(MAQ_NPM npm REQUIRED)
    message(STATUS "Fetching ${_ort_npm_name} ${_ort_npm_version} with npm (128 MB, once)")
    _maq_fetch("${_ort_npm_name}" "${MAQ_NPM}" pack --silent --pack-destination "${MAQ_DEPS_DIR}"
      ${_ort_npm_name}@${_ort_npm_version})
  endif()
  _maq_check_sha256("${archive}" ${_ort_npm_sha256})
endfunction()

function(_maq_fetch_jar archive)
  if(NOT EXISTS "${archive}")
    find_program(MAQ_MVN mvn REQUIRED)
    message(STATUS "Fetching ${_ort_jar_coordinates} with Maven (42 MB, once)")
    _maq_fetch("${_ort_jar_coordinates}" "${MAQ_MVN}" -B -q
      org.apache.maven.plugins:maven-dependency-plugin:3.8.1:copy -Dartifact=${_ort_jar_coordinates}
      "-DoutputDirectory=${MAQ_DEPS_DIR}" -Dmdep.useBaseVersion=true)
  endif()
  _maq_check_sha256("${archive}" ${_ort_jar_sha256})
endfunction()

# Unpacks what this target needs into `root`. The stamp is written last, so an interrupted unpacking starts again. The npm
# package is unpacked for the first target alone: programs of another build may be using its files when a second one comes.
function(_maq_unpack_onnxruntime root target)
  set(stamp "${root}/.${target}")
  if(EXISTS "${stamp}")
    return()
  endif()
  file(GLOB stamps_of_targets "${root}/.linux-*" "${root}/.android" "${root}/.windows-*")
  set(npm_archive "${MAQ_DEPS_DIR}/${_ort_npm_name}-${_ort_npm_version}.tgz")
  if(NOT stamps_of_targets)
    set(aar package/Plugins/Android/onnxruntime.aar)
    set(linux_x64 package/Plugins/Linux/x64/libonnxruntime.so)
    _maq_fetch_npm_package("${npm_archive}")
    file(ARCHIVE_EXTRACT INPUT "${npm_archive}" DESTINATION "${root}/npm" PATTERNS ${aar} ${linux_x64} package/LICENSE)
    file(ARCHIVE_EXTRACT INPUT "${root}/npm/${aar}" DESTINATION "${root}/android" PATTERNS "headers*" "jni*")
    file(REMOVE "${root}/npm/${aar}")
  endif()
  if(target STREQUAL "windows-x64")
    _maq_fetch_npm_package("${npm_archive}")
    file(ARCHIVE_EXTRACT INPUT "${npm_archive}" DESTINATION "${root}/npm"
      PATTERNS package/Plugins/Windows/x64/onnxruntime.dll)
  elseif(target STREQUAL "linux-aarch64")
    set(jar "${MAQ_DEPS_DIR}/onnxruntime-${MAQ_ONNXRUNTIME_VERSION}.jar")
    _maq_fetch_jar("${jar}")
    file(ARCHIVE_EXTRACT INPUT "${jar}" DESTINATION "${root}/jar" PATTERNS "ai/onnxruntime/native/linux-aarch64/*")
  endif()
  file(TOUCH "${stamp}")
endfunction()

# Where the target onnxruntime::onnxruntime has its library: an imported one's file, which is what is opened at run time.
function(_maq_find_target_library output)
  get_target_property(type onnxruntime::onnxruntime TYPE)
  get_target_property(configurations onnxruntime::onnxruntime IMPORTED_CONFIGURATIONS)
  set(file)
  foreach(suffix "" _RELEASE _RELWITHDEBINFO _NOCONFIG ${configurations})
    string(REGEX REPLACE "^([^_])" "_\\1" suffix "${suffix}")
    get_target_property(location onnxruntime::onnxruntime IMPORTED_LOCATION${suffix})
    if(location AND NOT file)
      set(file "${location}")
    endif()
  endforeach()
  if(type STREQUAL "STATIC_LIBRARY" OR NOT file OR NOT file MATCHES "\\.so")
    message(FATAL_ERROR "The target onnxruntime::onnxruntime is no shared library that is there already "
      "(${type}, '${file}'). Maquette opens ONNX Runtime at run time: set MAQ_ONNXRUNTIME_DIR to a shared one.")
  endif()
  set(${output} "${file}" PARENT_SCOPE)
endfunction()

set(_ort_header_folders onnxruntime onnxruntime/core/session)
if(MAQ_ONNXRUNTIME_DIR)
  # Looked for each time, so that another folder counts at once.
  unset(MAQ_ONNXRUNTIME_INCLUDE_DIR CACHE)
  unset(MAQ_ONNXRUNTIME_LIBRARY CACHE)
  find_path(MAQ_ONNXRUNTIME_INCLUDE_DIR onnxruntime_c_api.h NO_DEFAULT_PATH
    HINTS "${MAQ_ONNXRUNTIME_DIR}" PATH_SUFFIXES include include/onnxruntime include/onnxruntime/core/session headers)
  find_file(MAQ_ONNXRUNTIME_LIBRARY NAMES libonnxruntime.so.1 libonnxruntime.so onnxruntime.dll NO_DEFAULT_PATH
    HINTS "${MAQ_ONNXRUNTIME_DIR}" PATH_SUFFIXES lib lib64 .)
  if(NOT MAQ_ONNXRUNTIME_INCLUDE_DIR OR NOT MAQ_ONNXRUNTIME_LIBRARY)
    message(FATAL_ERROR "MAQ_ONNXRUNTIME_DIR is '${MAQ_ONNXRUNTIME_DIR}', but include/onnxruntime_c_api.h or "
      "lib/libonnxruntime.so is missing there. Point it at an unpacked ONNX Runtime ${MAQ_ONNXRUNTIME_VERSION} or "
      "newer, or clear it so that one is fetched.")
  endif()
elseif(NOT MAQ_FETCH_ONNXRUNTIME)
  if(NOT TARGET onnxruntime::onnxruntime)
    find_package(onnxruntime CONFIG QUIET)
  endif()
  unset(MAQ_ONNXRUNTIME_INCLUDE_DIR CACHE)
  unset(MAQ_ONNXRUNTIME_LIBRARY CACHE)
  if(TARGET onnxruntime::onnxruntime)
    get_target_property(_ort_folders onnxruntime::onnxruntime INTERFACE_INCLUDE_DIRECTORIES)
    find_path(MAQ_ONNXRUNTIME_INCLUDE_DIR onnxruntime_c_api.h NO_DEFAULT_PATH NO_CMAKE_FIND_ROOT_PATH
      HINTS ${_ort_folders} PATH_SUFFIXES ${_ort_header_folders})
    _maq_find_target_library(MAQ_ONNXRUNTIME_LIBRARY)
  else()
    find_path(MAQ_ONNXRUNTIME_INCLUDE_DIR onnxruntime_c_api.h PATH_SUFFIXES ${_ort_header_folders})
    find_library(MAQ_ONNXRUNTIME_LIBRARY onnxruntime)
  endif()
  if(NOT MAQ_ONNXRUNTIME_INCLUDE_DIR OR NOT MAQ_ONNXRUNTIME_LIBRARY)
    message(FATAL_ERROR "ONNX Runtime (onnxruntime_c_api.h, libonnxruntime.so) was not found, neither as a target "
      "onnxruntime::onnxruntime nor as a package. Install one, set MAQ_ONNXRUNTIME_DIR to an unpacked ONNX Runtime "
      "${MAQ_ONNXRUNTIME_VERSION} or newer, or set MAQ_FETCH_ONNXRUNTIME=ON to fetch one with npm or Maven.")
  endif()
else()
  if(ANDROID)
    set(_ort_target android)
  elseif(WIN32)
    set(_ort_target windows-x64)
  elseif(CMAKE_SYSTEM_PROCESSOR MATCHES "^(aarch64|arm64)$")
    set(_ort_target linux-aarch64)
  else()
    set(_ort_target linux-x64)
  endif()
  set(_ort_root "${MAQ_DEPS_DIR}/onnxruntime-${MAQ_ONNXRUNTIME_VERSION}")
  _maq_unpack_onnxruntime("${_ort_root}" ${_ort_target})
  set(MAQ_ONNXRUNTIME_INCLUDE_DIR "${_ort_root}/android/headers")
  set(_ort_library_of_android "android/jni/${ANDROID_ABI}/libonnxruntime.so")
  set(_ort_library_of_windows-x64 npm/package/Plugins/Windows/x64/onnxruntime.dll)
  set(_ort_library_of_linux-x64 npm/package/Plugins/Linux/x64/libonnxruntime.so)
  set(_ort_library_of_linux-aarch64 jar/ai/onnxruntime/native/linux-aarch64/libonnxruntime.so)
  set(MAQ_ONNXRUNTIME_LIBRARY "${_ort_root}/${_ort_library_of_${_ort_target}}")
endif()

file(STRINGS "${MAQ_ONNXRUNTIME_INCLUDE_DIR}/onnxruntime_c_api.h" _ort_api REGEX "#define ORT_API_VERSION +[0-9]+")
string(REGEX REPLACE ".* ([0-9]+).*" "\\1" _ort_api "${_ort_api}")
if(NOT _ort_api GREATER_EQUAL _ort_min_api)
  message(FATAL_ERROR "ONNX Runtime in ${MAQ_ONNXRUNTIME_INCLUDE_DIR} is version 1.${_ort_api}; 1.${_ort_min_api} or "
    "newer is needed. Set MAQ_ONNXRUNTIME_DIR to one, or MAQ_FETCH_ONNXRUNTIME=ON to fetch "
    "${MAQ_ONNXRUNTIME_VERSION} with npm or Maven.")
endif()

# The name under which the loader finds it where it is not installed beside libmaquette.so: some distributions put more of
# the version into it than the project does.
set(MAQ_ONNXRUNTIME_SONAME libonnxruntime.so.1)
if(ANDROID)  # packed under a name of its own (scripts/android/rename_library.py), which is as long
  set(MAQ_ONNXRUNTIME_SONAME libmaquetteort.so)
endif()
execute_process(COMMAND "${CMAKE_READELF}" -d "${MAQ_ONNXRUNTIME_LIBRARY}" OUTPUT_VARIABLE _ort_dynamic
  ERROR_VARIABLE _ort_error RESULT_VARIABLE _ort_failed)
if(NOT ANDROID AND NOT _ort_failed AND _ort_dynamic MATCHES "SONAME[^\n]*\\[([^]\n]+)\\]")
  set(MAQ_ONNXRUNTIME_SONAME "${CMAKE_MATCH_1}")
endif()

# Its name beside the library, and that of the library.
set(MAQ_ONNXRUNTIME_FILE libonnxruntime.so.1)
set(MAQ_LIBRARY_FILE libmaquette.so)
if(WIN32)
  set(MAQ_ONNXRUNTIME_FILE onnxruntime.dll)
  set(MAQ_LIBRARY_FILE maquette.dll)
  set(MAQ_ONNXRUNTIME_SONAME onnxruntime.dll)
endif()

add_library(maq_onnxruntime_headers INTERFACE)
target_include_directories(maq_onnxruntime_headers SYSTEM INTERFACE "${MAQ_ONNXRUNTIME_INCLUDE_DIR}")
