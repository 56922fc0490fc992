# Installs the build, moves the installed tree elsewhere, builds the programs of this folder against it in WAY
# (find_package or pkg_config), and runs them: cmake -DWAY=… -DBUILD_DIR=… -DWORK_DIR=… -P run.cmake
set(installed "${WORK_DIR}/installed")
set(moved "${WORK_DIR}/moved")
file(REMOVE_RECURSE "${WORK_DIR}")
file(MAKE_DIRECTORY "${WORK_DIR}")
function(run)
  execute_process(COMMAND ${ARGV} WORKING_DIRECTORY "${WORK_DIR}" OUTPUT_VARIABLE output ERROR_VARIABLE output
    RESULT_VARIABLE result)
  if(result)
    list(JOIN ARGV " " command)
    message(FATAL_ERROR "${command}\n${output}")
  endif()
  set(output "${output}" PARENT_SCOPE)
endfunction()

run("${CMAKE_COMMAND}" --install "${BUILD_DIR}" --prefix "${installed}")
# An installed tree must not know where it was installed to.
file(RENAME "${installed}" "${moved}")

if(WAY STREQUAL "find_package")
  run("${CMAKE_COMMAND}" -S "${CMAKE_CURRENT_LIST_DIR}" -B build -DCMAKE_BUILD_TYPE=Release
    "-DCMAKE_PREFIX_PATH=${moved}")
  run("${CMAKE_COMMAND}" --build build)
  set(programs build/people build/count_people)
  set(scene "${CMAKE_CURRENT_LIST_DIR}/../native/data/tiny_scene")
  run(build/new_view "${scene}/bundle" "${scene}/capture" view.png)
  file(READ "${WORK_DIR}/view.png" head LIMIT 26 HEX)
  if(NOT head MATCHES "^89504e470d0a1a0a0000000d494844520000004800000038")  # 72 x 56 pixels
    message(FATAL_ERROR "new_view wrote ${head}")
  endif()
  run(build/box_size "image:${CMAKE_CURRENT_LIST_DIR}/../media/box_depth.png?depth_unit=0.001&fx=600")
  if(NOT output MATCHES "^4[0-9][0-9] x 4[0-9][0-9] x 4[0-9][0-9] mm, each within [0-9]+, [0-9]+ and [0-9]+ mm\n$")
    message(FATAL_ERROR "box_size printed ${output}")  # the carton is 441 x 427 x 411 mm
  endif()
  run(build/head "image:${CMAKE_CURRENT_LIST_DIR}/../media/photo.jpg" head.glb
    "${CMAKE_CURRENT_LIST_DIR}/../native/data/round_heads/bundle")
  file(READ "${WORK_DIR}/head.glb" head LIMIT 4 HEX)
  if(NOT output MATCHES "the nose ends [0-9]+ mm before" OR NOT head STREQUAL "676c5446")  # "glTF"
    message(FATAL_ERROR "head printed ${output} and wrote ${head}")
  endif()
  run(build/surprise "stub:people?frames=12&size=320x240")
  if(NOT output MATCHES "^12 frames\n$")
    message(FATAL_ERROR "surprise printed ${output}")
  endif()
else()
  set(ENV{PKG_CONFIG_PATH} "${moved}/${LIBDIR}/pkgconfig")
  run(pkg-config --cflags --libs "maquette >= 0.2")
  string(STRIP "${output}" flags)
  separate_arguments(flags UNIX_COMMAND "${flags}")
  run("${C_COMPILER}" -std=c99 -Wall -Werror "${CMAKE_CURRENT_LIST_DIR}/people.c" -o people ${flags})
  set(programs ./people)
endif()

foreach(program ${programs})
  run("${program}" "stub:pattern?frames=1&size=320x256")
  # The program's own failure, too, is a sentence and an exit code.
  execute_process(COMMAND "${program}" "image:missing.jpg" WORKING_DIRECTORY "${WORK_DIR}"
    RESULT_VARIABLE result ERROR_VARIABLE error)
  if(NOT result EQUAL 1 OR NOT error MATCHES "missing.jpg does not exist")
    message(FATAL_ERROR "${program} with a missing image: exit code ${result}, ${error}")
  endif()
endforeach()
foreach(licence LICENSE onnxruntime/LICENSE.txt onnxruntime/ThirdPartyNotices.txt)
  if(NOT EXISTS "${moved}/share/maquette/licenses/${licence}")
    message(FATAL_ERROR "The installed tree lacks share/maquette/licenses/${licence}")
  endif()
endforeach()
run("${moved}/bin/maquette" info)
if(NOT output MATCHES "ONNX Runtime   1[.]")
  message(FATAL_ERROR "The moved command line does not find its ONNX Runtime:\n${output}")
endif()
