#!/usr/bin/env bash
# odd_path_test.sh SOURCE : a page is embedded whatever the folder of the project is called.
set -uo pipefail
source=$1
out=$(mktemp -d)
trap 'rm -rf "$out"' EXIT

for name in 'c++' 'a, b' 'a b'; do
  project="$out/$name/project"
  mkdir -p "$project/cmake" "$project/src/report"
  cp "$source/cmake/SinerigPage.cmake" "$source/cmake/EmbedText.cmake" "$project/cmake/"
  cp -r "$source/src/report/page" "$project/src/report/"
  cat >"$project/CMakeLists.txt" <<'END'
cmake_minimum_required(VERSION 3.25)
project(odd NONE)
include(cmake/SinerigPage.cmake)
set(page "${CMAKE_CURRENT_SOURCE_DIR}/src/report/page")
sinerig_embed_page(HEADER report/page.h NAMESPACE odd TEMPLATE ${page}/page.html SCRIPTS ${page}/start.js)
add_custom_target(all_of_it ALL DEPENDS "${CMAKE_CURRENT_BINARY_DIR}/page.cpp")
END
  if ! { cmake -G Ninja -S "$project" -B "$project/build" && cmake --build "$project/build"; } >"$out/log" 2>&1; then
    echo "FAILED: in a folder called '$name':"
    cat "$out/log"
    exit 1
  fi
  for text in page_template page_style page_script; do
    grep -q "^const std::string_view $text =$" "$project/build/page.cpp" || { echo "FAILED: no $text"; exit 1; }
  done
done
