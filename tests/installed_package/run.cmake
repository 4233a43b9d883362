# SPDX-License-Identifier: GPL-3.0-or-later
# Installs the built tree, moves the installation away, and uses it from another project.
# Called by ctest with -DBUILD_DIR, -DSOURCE_DIR (of the library), -DCOMPILER, -DGENERATOR, -DBUILD_TYPE.
set(here ${BUILD_DIR}/tests/installed_package)
set(prefix "${here}/moved away")
file(REMOVE_RECURSE ${here})
file(MAKE_DIRECTORY ${here})

include(${CMAKE_CURRENT_LIST_DIR}/commands.cmake)

run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${here}/prefix)
file(RENAME ${here}/prefix "${prefix}")

# Private headers stay behind: the library may include them, its users need not have what they include.
file(GLOB_RECURSE private_headers "${prefix}/include/*hdf5_handle.hpp" "${prefix}/include/*integration.hpp")
if(private_headers)
  message(FATAL_ERROR "a private header was installed: ${private_headers}")
endif()

# Nothing installed may point back to where it was built.
file(GLOB_RECURSE cmake_files "${prefix}/*.cmake")
if(NOT cmake_files)
  message(FATAL_ERROR "no CMake package was installed under ${prefix}")
endif()
foreach(file IN LISTS cmake_files)
  file(READ "${file}" text)
  foreach(path IN ITEMS ${BUILD_DIR} ${SOURCE_DIR})
    string(FIND "${text}" "${path}" position)
    if(NOT position EQUAL -1)
      message(FATAL_ERROR "${file} contains the path ${path}")
    endif()
  endforeach()
endforeach()

# The installed programs start.
file(GLOB programs "${prefix}/bin/*")
foreach(program IN LISTS programs)
  run("${program}" --version)
endforeach()

run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${here}/build -G ${GENERATOR}
  -D CMAKE_CXX_COMPILER=${COMPILER} -D CMAKE_BUILD_TYPE=${BUILD_TYPE} "-DCMAKE_PREFIX_PATH=${prefix}")
run(${CMAKE_COMMAND} --build ${here}/build)
run(${here}/build/uses_ductile)
set(expected "fourier solver: u = 32.000000000 in the middle\nvectors agree: true\n")
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the program printed\n${output}\ninstead of\n${expected}")
endif()

run(${here}/build/own_law)
set(expected "shear: traction beyond 1.2 of the first yield stress, agrees: true
billet: stress far beyond the first yield stress, agrees: true\n")
if(NOT output STREQUAL expected)
  message(FATAL_ERROR "the law of another project gave\n${output}\ninstead of\n${expected}")
endif()

run_to_fail(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/../c_only -B ${here}/c_only -G ${GENERATOR} "-DCMAKE_PREFIX_PATH=${prefix}")
expect("ductile is a C++ library, and the project c_only has not enabled C")
