# What a server of a simulation of one's own links: find_package(tandem COMPONENTS host) gives tandem::host and the
# servers' and clients' ports, tandem::transport_dds and tandem::transport_simulated. Static libraries and the headers
# below include/tandem-host, included by the same paths as here. Only `cmake --install BUILD --component host` installs it.
include(GNUInstallDirs)
set(libraries host accounts simulation workers statistics timeline codec predict layout lattice
  transport transport_simulated transport_dds topics)
foreach(library ${libraries})
  set_target_properties(tandem_${library} PROPERTIES EXPORT_NAME ${library})
  target_compile_features(tandem_${library} INTERFACE cxx_std_20)
endforeach()
list(TRANSFORM libraries PREPEND tandem_)
install(TARGETS ${libraries} EXPORT tandem_host_targets
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT host EXCLUDE_FROM_ALL
  INCLUDES DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem-host ${CMAKE_INSTALL_INCLUDEDIR})
foreach(folder sdk/core sdk/statistics sdk/transport services/accounts services/host)
  get_filename_component(parent ${folder} DIRECTORY)
  install(DIRECTORY ${PROJECT_SOURCE_DIR}/${folder} DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem-host/${parent}
    COMPONENT host EXCLUDE_FROM_ALL FILES_MATCHING PATTERN *.hpp PATTERN dds EXCLUDE)
endforeach()
# The one header of that folder that knows no DDS.
install(FILES ${PROJECT_SOURCE_DIR}/sdk/transport/dds/dds_ports.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem-host/sdk/transport/dds COMPONENT host EXCLUDE_FROM_ALL)
install(FILES ${PROJECT_SOURCE_DIR}/sdk/include/tandem/body_shape.hpp ${PROJECT_SOURCE_DIR}/sdk/include/tandem/result.hpp
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/tandem
  COMPONENT host EXCLUDE_FROM_ALL)
install(EXPORT tandem_host_targets FILE tandemHostTargets.cmake NAMESPACE tandem::
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tandem COMPONENT host EXCLUDE_FROM_ALL)
# The package's own files, which the SDK installs too.
install(FILES ${PROJECT_BINARY_DIR}/sdk/package/tandemConfig.cmake ${PROJECT_BINARY_DIR}/sdk/package/tandemConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/tandem COMPONENT host EXCLUDE_FROM_ALL)
