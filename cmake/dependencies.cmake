# SPDX-License-Identifier: GPL-3.0-or-later
# What the library needs, in one list: CMakeLists.txt reads it, and the installed package reads it again
# on behalf of whoever links the library. (Debian's names of the same things are in the launcher.)
include(CMakeFindDependencyMacro)
list(PREPEND CMAKE_MODULE_PATH ${CMAKE_CURRENT_LIST_DIR})

find_dependency(Threads)
find_dependency(fmt)
find_dependency(CLI11)
find_dependency(nlohmann_json)
find_dependency(tomlplusplus)
find_dependency(ZLIB)
find_dependency(Eigen3 3.4 NO_MODULE)
find_dependency(SUNDIALS 6.4 COMPONENTS arkode cvode ida kinsol nvecserial sunmatrixdense sunlinsoldense sunlinsolpcg
  sunlinsolspbcgs sunlinsolspfgmr sunlinsolspgmr sunnonlinsolfixedpoint)
if(SUNDIALS_VERSION VERSION_GREATER_EQUAL 7 AND (TARGET MPI::MPI_C OR TARGET MPI::MPI_CXX))
  # Built with MPI, these libraries name its targets for C and for C++; SUNDIALS looks for those of the languages in use.
  if(NOT TARGET MPI::MPI_CXX)
    find_dependency(MPI COMPONENTS CXX)
  endif()
  if(NOT TARGET MPI::MPI_C)
    add_library(MPI::MPI_C INTERFACE IMPORTED)
    target_link_libraries(MPI::MPI_C INTERFACE MPI::MPI_CXX)
  endif()
endif()
find_dependency(CHOLMOD MODULE)
find_dependency(PkgConfig)
pkg_check_modules(FFTW3 REQUIRED IMPORTED_TARGET fftw3)
pkg_search_module(HDF5 REQUIRED IMPORTED_TARGET hdf5-serial hdf5)

list(POP_FRONT CMAKE_MODULE_PATH)
