# Installs the library so that CMake (find_package(whisker), whisker::whisker, whisker::whisker_static) and pkg-config
# (whisker) find it wherever it was put: `cmake --install build --prefix WHERE`.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/whisker)

install(TARGETS whisker whisker_static EXPORT whisker-targets)
install(DIRECTORY include/whisker TYPE INCLUDE)
install(EXPORT whisker-targets NAMESPACE whisker:: DESTINATION ${package_dir})
configure_package_config_file(cmake/whisker-config.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/whisker-config.cmake
    INSTALL_DESTINATION ${package_dir})
write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/whisker-config-version.cmake COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_CURRENT_BINARY_DIR}/whisker-config.cmake ${CMAKE_CURRENT_BINARY_DIR}/whisker-config-version.cmake
    DESTINATION ${package_dir})

# Written when it is installed, for only then the prefix is known.
set(pkgconfig_template ${CMAKE_CURRENT_SOURCE_DIR}/cmake/whisker.pc.in)
set(PROJECT_DESCRIPTION "From the whisker bridge's USB interface to any number of reading processes")
install(CODE "
    set(CMAKE_INSTALL_LIBDIR \"${CMAKE_INSTALL_LIBDIR}\")
    set(CMAKE_INSTALL_INCLUDEDIR \"${CMAKE_INSTALL_INCLUDEDIR}\")
    set(PROJECT_DESCRIPTION \"${PROJECT_DESCRIPTION}\")
    set(PROJECT_VERSION \"${PROJECT_VERSION}\")
    get_filename_component(CMAKE_INSTALL_PREFIX \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
    configure_file(\"${pkgconfig_template}\" \"${CMAKE_CURRENT_BINARY_DIR}/whisker.pc\" @ONLY)
    file(INSTALL \"${CMAKE_CURRENT_BINARY_DIR}/whisker.pc\"
        DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/pkgconfig\")")
