# Runs at every build (not only at configure time, which does not see new commits) and rewrites the header only when a
# value changed, so that at most one source is compiled again. Without git, or outside a checkout, the hash is "unknown".
# Needs -D: SOURCE, INPUT, OUTPUT, GIT, COMPILER, FLAGS, BUILD_TYPE.
set(GIT_HASH unknown)
set(GIT_DIRTY 0)
if(GIT)
  # A tarball unpacked inside somebody else's checkout must not take that one's hash: ask for the top of the tree.
  execute_process(COMMAND ${GIT} -c safe.directory=${SOURCE} -C ${SOURCE} rev-parse --show-toplevel HEAD
                  OUTPUT_VARIABLE answer ERROR_QUIET RESULT_VARIABLE failed OUTPUT_STRIP_TRAILING_WHITESPACE)
  string(REPLACE "\n" ";" answer "${answer}")
  list(LENGTH answer parts)
  if(NOT failed AND parts EQUAL 2)
    list(GET answer 0 top)
    get_filename_component(top "${top}" REALPATH)
    get_filename_component(source "${SOURCE}" REALPATH)
    if(top STREQUAL source)
      list(GET answer 1 GIT_HASH)
      execute_process(COMMAND ${GIT} -c safe.directory=${SOURCE} -C ${SOURCE} status --porcelain
                      OUTPUT_VARIABLE changes ERROR_QUIET OUTPUT_STRIP_TRAILING_WHITESPACE)
      if(changes)
        set(GIT_DIRTY 1)
      endif()
    endif()
  endif()
endif()
foreach(value COMPILER FLAGS BUILD_TYPE)
  string(REPLACE "\\" "\\\\" ${value} "${${value}}")
  string(REPLACE "\"" "\\\"" ${value} "${${value}}")
endforeach()
configure_file(${INPUT} ${OUTPUT} @ONLY)
