# MAQ_GIT_COMMIT: the commit of this source tree, with '+' when files differ from it; 'unknown' outside git.
# Read when CMake configures, and CMake configures again when HEAD moves.
set(MAQ_GIT_COMMIT unknown)
find_package(Git QUIET)
if(Git_FOUND AND EXISTS "${PROJECT_SOURCE_DIR}/.git")
  execute_process(COMMAND "${GIT_EXECUTABLE}" rev-parse --short=12 HEAD WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}"
    OUTPUT_VARIABLE _maq_head OUTPUT_STRIP_TRAILING_WHITESPACE ERROR_QUIET RESULT_VARIABLE _maq_git_failed)
  if(NOT _maq_git_failed)
    execute_process(COMMAND "${GIT_EXECUTABLE}" diff --quiet HEAD -- sdk cmake CMakeLists.txt
      WORKING_DIRECTORY "${PROJECT_SOURCE_DIR}" RESULT_VARIABLE _maq_dirty)
    set(MAQ_GIT_COMMIT "${_maq_head}")
    if(_maq_dirty)
      string(APPEND MAQ_GIT_COMMIT "+")
    endif()
  endif()
  if(EXISTS "${PROJECT_SOURCE_DIR}/.git/logs/HEAD")
    set_property(DIRECTORY APPEND PROPERTY CMAKE_CONFIGURE_DEPENDS "${PROJECT_SOURCE_DIR}/.git/logs/HEAD")
  endif()
endif()
