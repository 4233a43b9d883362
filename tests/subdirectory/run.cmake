# SPDX-License-Identifier: GPL-3.0-or-later
# Configures projects that add the library's folder, SOURCE_DIR, to their own in BUILD_DIR, and compiles against its headers.
# Called by ctest with -DBUILD_DIR, -DSOURCE_DIR, -DCOMPILER, -DGENERATOR.
file(REMOVE_RECURSE ${BUILD_DIR})
include(${CMAKE_CURRENT_LIST_DIR}/../installed_package/commands.cmake)

run(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR} -B ${BUILD_DIR} -G ${GENERATOR} -D DUCTILE=${SOURCE_DIR}
  -D CMAKE_CXX_COMPILER=${COMPILER})
run(${CMAKE_COMMAND} --build ${BUILD_DIR} --target includes)
run(${CMAKE_COMMAND} --install ${BUILD_DIR} --prefix ${BUILD_DIR}/prefix)
if(EXISTS ${BUILD_DIR}/prefix)
  message(FATAL_ERROR "the library installed itself with the project that adds it")
endif()

run_to_fail(${CMAKE_COMMAND} -S ${CMAKE_CURRENT_LIST_DIR}/../c_only -B ${BUILD_DIR}/c_only -G ${GENERATOR} -D DUCTILE=${SOURCE_DIR})
expect("ductile is a C++ library, and the project c_only that adds it has not enabled C")
