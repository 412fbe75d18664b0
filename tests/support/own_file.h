// A file in the folder for temporary ones that no test running beside this one writes, too.
#pragma once

#include <algorithm>
#include <string>

#include <gtest/gtest.h>

namespace sinerig::test {

inline std::string own_file(const std::string& name) {
  const testing::TestInfo* test = testing::UnitTest::GetInstance()->current_test_info();
  std::string own = std::string{test->test_suite_name()} + "-" + test->name() + "-" + name;
  std::replace(own.begin(), own.end(), '/', '-');
  return testing::TempDir() + own;
}

}  // namespace sinerig::test
