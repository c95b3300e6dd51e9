# Installs the libraries so that CMake (find_package(whisker), whisker::whisker, whisker::nav, whisker::create, and the
# same with _static) and pkg-config (whisker, whisker-nav, whisker-create) find them wherever they were put:
# `cmake --install build --prefix WHERE`.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)
set(whisker_cmake_dir ${CMAKE_CURRENT_LIST_DIR})

# A library's targets and its file for pkg-config. NAME: lib and pkg-config name. INCLUDE: its headers' folder below
# the include directory. REQUIRES, LIBS: what the static library needs.
function(whisker_install_library name)
    cmake_parse_arguments(LIB "" "DESCRIPTION;INCLUDE;REQUIRES;LIBS" "TARGETS" ${ARGN})
    install(TARGETS ${LIB_TARGETS} EXPORT whisker-targets)
    # Written when it is installed, for only then the prefix is known.
    install(CODE "
        set(NAME \"${name}\")
        set(DESCRIPTION \"${LIB_DESCRIPTION}\")
        set(INCLUDE \"${LIB_INCLUDE}\")
        set(REQUIRES \"${LIB_REQUIRES}\")
        set(LIBS \"${LIB_LIBS}\")
        set(CMAKE_INSTALL_LIBDIR \"${CMAKE_INSTALL_LIBDIR}\")
        set(CMAKE_INSTALL_INCLUDEDIR \"${CMAKE_INSTALL_INCLUDEDIR}\")
        set(PROJECT_VERSION \"${PROJECT_VERSION}\")
        get_filename_component(CMAKE_INSTALL_PREFIX \"\${CMAKE_INSTALL_PREFIX}\" ABSOLUTE)
        configure_file(\"${whisker_cmake_dir}/library.pc.in\" \"${CMAKE_CURRENT_BINARY_DIR}/${name}.pc\" @ONLY)
        file(INSTALL \"${CMAKE_CURRENT_BINARY_DIR}/${name}.pc\"
            DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_LIBDIR}/pkgconfig\")")
endfunction()

# A program's manual page, by help2man of what its --help says; none where help2man is not installed.
find_program(HELP2MAN help2man)
function(whisker_install_page program summary)
    if(HELP2MAN)
        install(CODE "
            set(page \"${CMAKE_CURRENT_BINARY_DIR}/${program}.1\")
            execute_process(COMMAND ${HELP2MAN} --no-info --name \"${summary}\" --output \${page}
                $<TARGET_FILE:${program}> COMMAND_ERROR_IS_FATAL ANY)
            file(INSTALL \${page} DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_MANDIR}/man1\")")
    endif()
endfunction()

# The CMake package of all libraries.
function(whisker_install_package)
    set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/whisker)
    install(EXPORT whisker-targets NAMESPACE whisker:: DESTINATION ${package_dir})
    configure_package_config_file(${whisker_cmake_dir}/whisker-config.cmake.in
        ${CMAKE_CURRENT_BINARY_DIR}/whisker-config.cmake INSTALL_DESTINATION ${package_dir})
    write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/whisker-config-version.cmake
        COMPATIBILITY SameMinorVersion)
    install(FILES ${CMAKE_CURRENT_BINARY_DIR}/whisker-config.cmake
        ${CMAKE_CURRENT_BINARY_DIR}/whisker-config-version.cmake DESTINATION ${package_dir})
endfunction()

# The library of a static target as a shared one, too: TARGET_shared, exported as whisker::TARGET, beside
# whisker::TARGET_static. HEADERS: its public headers, installed to INCLUDE.
function(whisker_share target name)
    cmake_parse_arguments(LIB "" "DESCRIPTION;INCLUDE" "HEADERS" ${ARGN})
    add_library(${target}_shared SHARED $<TARGET_OBJECTS:${target}>)
    target_link_libraries(${target}_shared PUBLIC m)
    foreach(library ${target} ${target}_shared)
        target_include_directories(${library} INTERFACE $<INSTALL_INTERFACE:${CMAKE_INSTALL_INCLUDEDIR}/${LIB_INCLUDE}>)
        set_target_properties(${library} PROPERTIES OUTPUT_NAME ${name})
    endforeach()
    set_target_properties(${target} PROPERTIES C_VISIBILITY_PRESET hidden EXPORT_NAME ${target}_static)
    set_target_properties(${target}_shared PROPERTIES LINKER_LANGUAGE C EXPORT_NAME ${target} VERSION ${PROJECT_VERSION}
        SOVERSION ${PROJECT_VERSION_MAJOR}.${PROJECT_VERSION_MINOR})
    install(FILES ${LIB_HEADERS} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/${LIB_INCLUDE})
    whisker_install_library(${name} TARGETS ${target} ${target}_shared DESCRIPTION ${LIB_DESCRIPTION}
        INCLUDE /${LIB_INCLUDE} LIBS "-lm")
endfunction()
