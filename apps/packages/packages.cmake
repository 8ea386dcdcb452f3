# What `cpack` makes of a build: three Debian packages (README.md of this folder).
#   talus          program, scenes, pages, man page, completion
#   libtalus-dev   static libraries, headers, the configuration for find_package
#   python3-talus  apps/python

# The program writes both about itself.
install(CODE "
  foreach(page man completion)
    set(words \${page})
    if(page STREQUAL completion)
      list(APPEND words bash)
    endif()
    execute_process(COMMAND \"$<TARGET_FILE:talus>\" \${words} OUTPUT_FILE \"${PROJECT_BINARY_DIR}/talus.\${page}\" COMMAND_ERROR_IS_FATAL ANY)
  endforeach()" COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/talus.man DESTINATION ${CMAKE_INSTALL_MANDIR}/man1 RENAME talus.1 COMPONENT program)
install(FILES ${PROJECT_BINARY_DIR}/talus.completion DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions
        RENAME talus COMPONENT program)
install(FILES README.md CHANGELOG.md DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/talus COMPONENT program)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/talus COMPONENT program)
install(PROGRAMS apps/packages/smoke.sh DESTINATION ${CMAKE_INSTALL_DATADIR}/talus COMPONENT program)
install(DIRECTORY apps/python/talus DESTINATION lib/python3/dist-packages COMPONENT python PATTERN __pycache__ EXCLUDE)

# `install` and `cpack` take what has been built, and build no tests for that.
set(CMAKE_SKIP_INSTALL_ALL_DEPENDENCY ON)
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME talus)
set(CPACK_PACKAGE_VENDOR "the Talus authors")
set(CPACK_PACKAGE_CONTACT "the Talus authors <talus@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_PACKAGE_DIRECTORY ${PROJECT_BINARY_DIR}/packages)
set(CPACK_COMPONENTS_ALL program development python)
set(CPACK_COMPONENTS_GROUPING IGNORE)
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_NAME talus)
set(CPACK_DEBIAN_PROGRAM_DESCRIPTION "${PROJECT_DESCRIPTION}: the program")
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SHLIBDEPS ON)
# One rank starts without mpirun, but not without what stands beside it.
set(CPACK_DEBIAN_PROGRAM_PACKAGE_DEPENDS openmpi-bin)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_RECOMMENDS python3-talus)
set(CPACK_DEBIAN_PROGRAM_PACKAGE_SUGGESTS ffmpeg)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME libtalus-dev)
set(CPACK_DEBIAN_DEVELOPMENT_DESCRIPTION "${PROJECT_DESCRIPTION}: libraries and headers")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
    "libopenmpi-dev, libhdf5-openmpi-dev, libeigen3-dev, libmetis-dev, zlib1g-dev, libfmt-dev, nlohmann-json3-dev, libtomlplusplus-dev")
set(CPACK_DEBIAN_PYTHON_PACKAGE_NAME python3-talus)
set(CPACK_DEBIAN_PYTHON_DESCRIPTION "${PROJECT_DESCRIPTION}: runs in Python")
set(CPACK_DEBIAN_PYTHON_PACKAGE_SECTION python)
set(CPACK_DEBIAN_PYTHON_PACKAGE_ARCHITECTURE all)
set(CPACK_DEBIAN_PYTHON_PACKAGE_DEPENDS
    "talus, python3 (>= 3.11), python3-h5py, python3-numpy, python3-matplotlib, python3-tomli-w")
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/talus RENAME copyright COMPONENT program)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/libtalus-dev RENAME copyright COMPONENT development)
install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DATADIR}/doc/python3-talus RENAME copyright COMPONENT python)
include(CPack)
