# SPDX-License-Identifier: Apache-2.0
# `cmake --install`: binaries, libraries, public headers, the wire contract, and a package config, so that
# find_package(warmfront) gives warmfront::engine and, where the service is built, warmfront::client; the unit and its settings.
include(CMakePackageConfigHelpers)

if(PROJECT_IS_TOP_LEVEL)
  set(CMAKE_INSTALL_DEFAULT_COMPONENT_NAME development)
  set(package_dir ${CMAKE_INSTALL_LIBDIR}/cmake/warmfront)
  # Headers keep their paths from the root, so that #include "engine/collider.h" works before and after installation.
  # Only public headers of the engine, which include none of its rooms.
  file(GLOB public_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/engine/*.h)
  install(FILES ${public_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/warmfront/engine)
  # A plug in headers alone, for programs that have IPC Toolkit.
  file(GLOB plug_headers CONFIGURE_DEPENDS ${PROJECT_SOURCE_DIR}/client/ipc_toolkit/*.h)
  install(FILES ${plug_headers} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/warmfront/client/ipc_toolkit)
  if(WARMFRONT_SERVICE)
    # A static library needs its dependencies at link time: install the contract; find_package() finds gRPC. In a file of
    # their own, which who asks for the engine alone does not read: they name gRPC's targets.
    install(TARGETS warmfront_proto warmfront_wire warmfront_client EXPORT warmfrontClientTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
    install(EXPORT warmfrontClientTargets NAMESPACE warmfront:: DESTINATION ${package_dir})
    install(TARGETS warmfrontd warmfront RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR} COMPONENT service)
    install(FILES deploy/systemd/warmfrontd.service DESTINATION lib/systemd/system COMPONENT service)
    install(FILES LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR} RENAME copyright COMPONENT service)
    # As GNUInstallDirs has it: /etc for the prefix /usr, and PREFIX/etc for others; but known only when installing.
    install(CODE "string(REGEX REPLACE \"/usr/*\\$\" \"\" root \"\${CMAKE_INSTALL_PREFIX}\")
                  file(INSTALL \"${PROJECT_SOURCE_DIR}/deploy/systemd/warmfrontd.toml\" DESTINATION \"\${root}/etc/warmfront\")"
            COMPONENT service)
    install(FILES client/lib/answer.h client/lib/any_session.h client/lib/client.h client/lib/pending.h client/lib/questions.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/warmfront/client/lib)
    # For C and what calls it: no other library's name is in its interface, nor needed at link time.
    install(FILES client/c/warmfront.h DESTINATION ${CMAKE_INSTALL_INCLUDEDIR})
    install(TARGETS warmfront_c EXPORT warmfrontTargets LIBRARY DESTINATION ${CMAKE_INSTALL_LIBDIR})
    install(DIRECTORY proto/warmfront DESTINATION ${CMAKE_INSTALL_DATADIR}/warmfront/proto
            FILES_MATCHING PATTERN "*.proto")
  endif()
  install(TARGETS warmfront_engine EXPORT warmfrontTargets ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR})
  install(EXPORT warmfrontTargets NAMESPACE warmfront:: DESTINATION ${package_dir})

  configure_package_config_file(deploy/cmake/warmfrontConfig.cmake.in ${CMAKE_CURRENT_BINARY_DIR}/warmfrontConfig.cmake
                                INSTALL_DESTINATION ${package_dir})
  write_basic_package_version_file(${CMAKE_CURRENT_BINARY_DIR}/warmfrontConfigVersion.cmake
                                   COMPATIBILITY SameMinorVersion)
  install(FILES ${CMAKE_CURRENT_BINARY_DIR}/warmfrontConfig.cmake
                ${CMAKE_CURRENT_BINARY_DIR}/warmfrontConfigVersion.cmake
                deploy/cmake/FindGMP.cmake
          DESTINATION ${package_dir})
  if(WARMFRONT_SERVICE)
    include(deploy/cmake/package.cmake)
  endif()
endif()
