# The report's page: the live page shows the same plots, with other scripts at the end.
set(SINERIG_PAGE_SCRIPTS format scale state plot pointer plane tables histogram figures loop main)
set(SINERIG_PAGE_STYLES theme page plot table media)

# sinerig_join_texts(OUT file …) : as EmbedText.cmake reads them.
function(sinerig_join_texts out)
  set(names "")
  foreach(file IN LISTS ARGN)
    file(RELATIVE_PATH name "${PROJECT_SOURCE_DIR}" "${file}")
    list(APPEND names "${name}")
  endforeach()
  list(JOIN names "+" joined)
  set(${out} "${joined}" PARENT_SCOPE)
endfunction()

# sinerig_embed_page(HEADER h NAMESPACE n TEMPLATE file [SCRIPTS file …] [STYLES file …])
# Embeds a page in ${CMAKE_CURRENT_BINARY_DIR}/page.cpp: the template, and the report's scripts and
# styles with those given behind them.
function(sinerig_embed_page)
  cmake_parse_arguments(arg "" "HEADER;NAMESPACE;TEMPLATE" "SCRIPTS;STYLES" ${ARGN})
  set(report_page "${PROJECT_SOURCE_DIR}/src/report/page")
  set(scripts "")
  set(styles "")
  foreach(name IN LISTS SINERIG_PAGE_SCRIPTS)
    list(APPEND scripts "${report_page}/${name}.js")
  endforeach()
  foreach(name IN LISTS SINERIG_PAGE_STYLES)
    list(APPEND styles "${report_page}/${name}.css")
  endforeach()
  list(APPEND scripts ${arg_SCRIPTS})
  list(APPEND styles ${arg_STYLES})
  sinerig_join_texts(joined_template "${arg_TEMPLATE}")
  sinerig_join_texts(joined_scripts ${scripts})
  sinerig_join_texts(joined_styles ${styles})
  set(page "${CMAKE_CURRENT_BINARY_DIR}/page.cpp")
  set(embed "${PROJECT_SOURCE_DIR}/cmake/EmbedText.cmake")
  # Scripts are longer than what a compiler must take in one literal; both take it.
  set_source_files_properties("${page}" PROPERTIES COMPILE_OPTIONS -Wno-overlength-strings)
  add_custom_command(
    OUTPUT "${page}"
    COMMAND ${CMAKE_COMMAND}
      -D "OUTPUT=${page}" -D "HEADER=${arg_HEADER}" -D "NAMESPACE=${arg_NAMESPACE}"
      -D "ROOT=${PROJECT_SOURCE_DIR}"
      -D "TEXTS=page_template:${joined_template},page_style:${joined_styles},page_script:${joined_scripts}"
      -P "${embed}"
    DEPENDS "${arg_TEMPLATE}" ${styles} ${scripts} "${embed}"
    COMMENT "Embedding the page of ${arg_NAMESPACE}"
    VERBATIM)
endfunction()
