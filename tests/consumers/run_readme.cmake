# Runs the commands that docs/guide/link.md has for its C program, as they stand there, in a folder with the build and the tests,
# and with a home of its own: cmake -DSOURCE_DIR=… -DBUILD_DIR=… -DWORK_DIR=… -P run_readme.cmake
file(READ "${SOURCE_DIR}/docs/guide/link.md" readme)
if(NOT readme MATCHES "\n    cmake --install [^\n]*\n(    [^\n]*\n)+")
  message(FATAL_ERROR "docs/guide/link.md has no commands that begin with cmake --install.")
endif()
string(REGEX REPLACE "\n    " "\n" commands "${CMAKE_MATCH_0}")
file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}/home" "${WORK_DIR}/tree/build")
file(CREATE_LINK "${BUILD_DIR}" "${WORK_DIR}/tree/build/release" SYMBOLIC)
file(CREATE_LINK "${SOURCE_DIR}/tests" "${WORK_DIR}/tree/tests" SYMBOLIC)
file(CREATE_LINK "${SOURCE_DIR}/examples" "${WORK_DIR}/tree/examples" SYMBOLIC)
file(WRITE "${WORK_DIR}/commands.sh" "${commands}")
# What the reader's terminal does not have either.
set(unset --unset=LD_LIBRARY_PATH --unset=LD_RUN_PATH)
execute_process(COMMAND "${CMAKE_COMMAND}" -E env ${unset} "HOME=${WORK_DIR}/home" sh -e "${WORK_DIR}/commands.sh"
  WORKING_DIRECTORY "${WORK_DIR}/tree" OUTPUT_VARIABLE output ERROR_VARIABLE output RESULT_VARIABLE result)
if(result OR NOT output MATCHES "\nperson 0[.][0-9]+ at x [0-9]+ y [0-9]+\n")
  message(FATAL_ERROR "${commands}ended with ${result} and finds nobody in the photo:\n${output}")
endif()
