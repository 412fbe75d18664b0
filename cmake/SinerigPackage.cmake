# `cmake --install` and `cpack`: the program, its manual page and completions as the program itself
# prints them, documentation, rig files, and the systemd units.
include(GNUInstallDirs)

set(printed "${PROJECT_BINARY_DIR}/printed")
set(manual_page "${printed}/sinerig.1")
set(completions "${printed}/sinerig.bash" "${printed}/_sinerig" "${printed}/sinerig.fish")
if(NOT SINERIG_SANITIZE)
  add_custom_command(
    OUTPUT ${manual_page} ${completions}
    COMMAND ${CMAKE_COMMAND} -E make_directory "${printed}"
    COMMAND sinerig manual > "${manual_page}"
    COMMAND sinerig completion bash > "${printed}/sinerig.bash"
    COMMAND sinerig completion zsh > "${printed}/_sinerig"
    COMMAND sinerig completion fish > "${printed}/sinerig.fish"
    DEPENDS sinerig
    COMMENT "Printing the manual page and the completions"
    VERBATIM)
  add_custom_target(printed ALL DEPENDS ${manual_page} ${completions})
  install(FILES "${manual_page}" DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
  install(FILES "${printed}/sinerig.bash" RENAME sinerig
          DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
  install(FILES "${printed}/_sinerig" DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
  install(FILES "${printed}/sinerig.fish" DESTINATION ${CMAKE_INSTALL_DATADIR}/fish/vendor_completions.d)
endif()

install(TARGETS sinerig DESTINATION ${CMAKE_INSTALL_BINDIR})
install(FILES README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES LICENSE RENAME copyright DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY config DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(FILES packaging/sinerig@.service packaging/sinerig-night@.service DESTINATION lib/systemd/system)

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_CONTACT "the sinerig team <sinerig@localhost>")
set(CPACK_PACKAGE_DESCRIPTION "Stepped-sine measurement over CAN and other buses, every point with its
95 % interval; transfer functions, margins and notch filters from it; reports for any browser.")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "frequency response of gimbals, servos and actuators")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "fonts-dejavu-core")
include(CPack)
