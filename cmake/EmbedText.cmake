# cmake -D OUTPUT=page.cpp -D HEADER=report/page.h -D NAMESPACE=sinerig::report -D ROOT=folder
#       -D "TEXTS=name:file[+file…],name:file" -P EmbedText.cmake
# Writes a source file with each text as a std::string_view; files joined by + follow each other. The files
# are those of ROOT, which may have + and , in it.
string(REPLACE "," ";" TEXTS "${TEXTS}")
set(source "#include \"${HEADER}\"\n\nnamespace ${NAMESPACE} {\n")
foreach(entry IN LISTS TEXTS)
  string(REGEX MATCH "^([^:]+):(.*)$" matched "${entry}")
  set(name "${CMAKE_MATCH_1}")
  string(REPLACE "+" ";" files "${CMAKE_MATCH_2}")
  set(literal "")
  foreach(file IN LISTS files)
    file(READ "${ROOT}/${file}" text)
    string(APPEND literal "R\"~embed~(${text})~embed~\"\n")
  endforeach()
  string(APPEND source "\nconst std::string_view ${name} =\n${literal};\n")
endforeach()
string(APPEND source "\n}  // namespace ${NAMESPACE}\n")
file(WRITE "${OUTPUT}" "${source}")
