# Builds Maquette as a part of the project in subproject/, where nothing may be fetched, and runs its program:
#   cmake -DSOURCE_DIR=… -DWORK_DIR=… -DLIBRARY=libonnxruntime.so -DHEADERS=… -P run_subproject.cmake
set(app "${CMAKE_CURRENT_LIST_DIR}/subproject")
file(REMOVE_RECURSE "${WORK_DIR}")
# A client that fetches packages would leave its name.
foreach(client npm mvn)
  file(WRITE "${WORK_DIR}/bin/${client}" "#!/bin/sh\necho ${client} >>'${WORK_DIR}/fetched'\nexit 1\n")
  file(CHMOD "${WORK_DIR}/bin/${client}" PERMISSIONS OWNER_READ OWNER_WRITE OWNER_EXECUTE)
endforeach()
set(ENV{PATH} "${WORK_DIR}/bin:$ENV{PATH}")

# Sets result and output.
function(run)
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY "${WORK_DIR}" OUTPUT_VARIABLE output ERROR_VARIABLE output
    RESULT_VARIABLE result)
  set(result "${result}" PARENT_SCOPE)
  set(output "${output}" PARENT_SCOPE)
endfunction()
function(must_run)
  run(${ARGV})
  if(NOT result EQUAL 0)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}: ${result}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()
function(must_be_refused why folder)
  run("${CMAKE_COMMAND}" -S "${app}" -B "${folder}" "-DMAQUETTE=${SOURCE_DIR}" ${ARGN})
  string(REGEX REPLACE "[ \n]+" " " output "${output}")
  if(result EQUAL 0 OR NOT output MATCHES "${why}")
    message(FATAL_ERROR "Expected '${why}':\n${output}")
  endif()
endfunction()

# --- the app's own ONNX Runtime ---------------------------------------------------------------------------------------

must_run("${CMAKE_COMMAND}" -S "${app}" -B build "-DMAQUETTE=${SOURCE_DIR}" -DONNXRUNTIME=target
  "-DONNXRUNTIME_LIBRARY=${LIBRARY}" "-DONNXRUNTIME_HEADERS=${HEADERS}" -DMAQ_UNITY_FILES=16
  -DMAQ_WITH_SCENES=OFF -DMAQ_WITH_EDGES=OFF -DMAQ_WITH_HEADS=OFF -DMAQ_WITH_PREDICTION=OFF
  -DMAQ_WITH_BODY=OFF)  # the app finds people
file(STRINGS "${WORK_DIR}/build/CMakeCache.txt" build_type REGEX "^CMAKE_BUILD_TYPE:")
if(NOT build_type MATCHES "^CMAKE_BUILD_TYPE:[A-Z]*=$")
  message(FATAL_ERROR "The app's build type was set: ${build_type}")
endif()
file(READ "${WORK_DIR}/build/compile_commands.json" commands)
string(REGEX MATCH "\"command\": \"[^\n]*examples/c/people.c\"" command "${commands}")
string(REGEX REPLACE " -I[^ ]*| -o [^ ]*| -c [^ ]*" "" flags "${command}")
if(NOT command OR flags MATCHES " -[A-Zf-m]")
  message(FATAL_ERROR "Options of Maquette reach the app's files: '${command}'")
endif()
must_run("${CMAKE_CTEST_COMMAND}" --test-dir build -N)
if(NOT output MATCHES "Total Tests: 0")
  message(FATAL_ERROR "The app has got tests:\n${output}")
endif()
must_run("${CMAKE_COMMAND}" --build build --parallel 2 --target people)
must_run(build/people "stub:pattern?frames=1&size=320x256")
# Of Maquette only what the app needs was built, and nothing is installed but by MAQ_INSTALL.
must_run("${CMAKE_COMMAND}" --install build --prefix installed)
file(GLOB_RECURSE installed RELATIVE "${WORK_DIR}/installed" "${WORK_DIR}/installed/*")
if(NOT installed STREQUAL "bin/people")
  message(FATAL_ERROR "Maquette's files were installed: ${installed}")
endif()

# --- a package; none; one that is too old -----------------------------------------------------------------------------

set(package "${WORK_DIR}/package/lib/cmake/onnxruntime")
file(WRITE "${package}/onnxruntimeConfig.cmake" "add_library(onnxruntime::onnxruntime SHARED IMPORTED)
set_target_properties(onnxruntime::onnxruntime PROPERTIES IMPORTED_CONFIGURATIONS RELEASE
  IMPORTED_LOCATION_RELEASE \"${LIBRARY}\" INTERFACE_INCLUDE_DIRECTORIES \"${HEADERS}\")
")
must_run("${CMAKE_COMMAND}" -S "${app}" -B package-build "-DMAQUETTE=${SOURCE_DIR}"
  "-Donnxruntime_DIR=${package}" -DMAQ_INSTALL=ON -DBUILD_SHARED_LIBS=OFF)
file(READ "${WORK_DIR}/package-build/CMakeFiles/people.dir/link.txt" link)
if(NOT link MATCHES "libmaquette[.]a" OR link MATCHES "libmaquette[.]so")
  message(FATAL_ERROR "With BUILD_SHARED_LIBS=OFF the app links ${link}")
endif()
get_filename_component(real "${LIBRARY}" REALPATH)
get_filename_component(staged
  "${WORK_DIR}/package-build/_deps/maquette-build/stage/lib/maquette/libonnxruntime.so.1" REALPATH)
if(NOT staged STREQUAL real)
  message(FATAL_ERROR "The package's ONNX Runtime is not the one that is opened: ${staged}")
endif()

must_be_refused("ONNX Runtime .* was not found, .* set MAQ_FETCH_ONNXRUNTIME=ON" none-build
  "-DCMAKE_FIND_ROOT_PATH=${WORK_DIR}/nothing" -DCMAKE_FIND_ROOT_PATH_MODE_INCLUDE=ONLY
  -DCMAKE_FIND_ROOT_PATH_MODE_LIBRARY=ONLY -DCMAKE_FIND_ROOT_PATH_MODE_PACKAGE=ONLY)

file(WRITE "${WORK_DIR}/old/onnxruntime_c_api.h" "#define ORT_API_VERSION 9\n")
must_be_refused("is version 1.9; 1.[0-9]+ or newer is needed" old-build -DONNXRUNTIME=target
  "-DONNXRUNTIME_LIBRARY=${LIBRARY}" "-DONNXRUNTIME_HEADERS=${WORK_DIR}/old")

if(EXISTS "${WORK_DIR}/fetched")
  file(READ "${WORK_DIR}/fetched" clients)
  message(FATAL_ERROR "Packages were fetched by ${clients}")
endif()
