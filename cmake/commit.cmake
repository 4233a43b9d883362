# SPDX-License-Identifier: GPL-3.0-or-later
# cmake -D SOURCE_DIR=... -D HEADER=... -P commit.cmake: tells version.cpp of which commit the sources are, "-dirty" where files have
# changed since; "unknown" where they are not the top folder of a repository. The header keeps its time where it says so already.
set(commit unknown)
find_program(git git)
if(git)
  set(in_source ${git} -c safe.directory=* -C ${SOURCE_DIR})
  execute_process(COMMAND ${in_source} rev-parse --show-prefix OUTPUT_VARIABLE prefix RESULT_VARIABLE no_repository
    ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
  if(NOT no_repository AND prefix STREQUAL "")
    execute_process(COMMAND ${in_source} describe --always --dirty --abbrev=12 --exclude=* OUTPUT_VARIABLE found
      RESULT_VARIABLE failed ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
    if(NOT failed)
      set(commit ${found})
    endif()
  endif()
endif()
file(CONFIGURE OUTPUT ${HEADER} CONTENT "#define DUCTILE_COMMIT \"${commit}\"\n")
