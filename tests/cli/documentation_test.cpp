// What the documentation shows exists: commands, their options, the files it leads to.
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <sstream>

#include <gmock/gmock.h>

#include "support/program.h"

namespace sinerig {
namespace {

namespace fs = std::filesystem;

class Documentation : public testing::Test {
 protected:
  static std::vector<fs::path> pages() {
    const fs::path root = SINERIG_SOURCE_DIR;
    std::vector<fs::path> all{root / "README.md"};
    for (const auto& entry : fs::directory_iterator{root / "docs"})
      if (entry.path().extension() == ".md") all.push_back(entry.path());
    return all;
  }
  static std::string text_of(const fs::path& path) {
    std::ifstream stream{path};
    return {std::istreambuf_iterator<char>{stream}, {}};
  }
  const std::string& help_of(const std::string& command) {
    const auto [found, added] = help_.try_emplace(command);
    if (added) found->second = workshop_.sinerig(command + " --help").output;
    return found->second;
  }

  test::Workshop workshop_;
  std::map<std::string, std::string> help_;
};

TEST_F(Documentation, ShowsCommandsAndOptionsThatExist) {
  const std::regex command{"sinerig ([a-z]+)((?: [^|;&`\\n]*)?)"};
  const std::regex option{"--[a-z][a-z-]*"};
  std::size_t checked = 0;
  for (const fs::path& page : pages()) {
    std::istringstream lines{text_of(page)};
    for (std::string line; std::getline(lines, line);) {
      // Prompts, and what stands in backquotes.
      const bool prompt = line.rfind("$ ", 0) == 0 || line.rfind("sinerig ", 0) == 0;
      if (!prompt && line.find("`sinerig ") == std::string::npos) continue;
      for (std::sregex_iterator at{line.begin(), line.end(), command}, end; at != end; ++at) {
        const std::string& help = help_of((*at)[1]);
        EXPECT_THAT(help, testing::HasSubstr("Usage: sinerig")) << page << ": " << at->str();
        const std::string rest = (*at)[2];
        for (std::sregex_iterator o{rest.begin(), rest.end(), option}; o != end; ++o)
          EXPECT_THAT(help + " --help --version", testing::HasSubstr(o->str()))
              << page << ": " << line;
        ++checked;
      }
    }
  }
  EXPECT_GT(checked, 30U);
}

TEST_F(Documentation, LeadsToFilesThatExist) {
  const std::regex link{"\\]\\(([^)#:]+)\\)"};
  for (const fs::path& page : pages()) {
    const std::string text = text_of(page);
    for (std::sregex_iterator at{text.begin(), text.end(), link}, end; at != end; ++at)
      EXPECT_TRUE(fs::exists(page.parent_path() / (*at)[1].str())) << page << ": " << (*at)[1];
  }
}

}  // namespace
}  // namespace sinerig
