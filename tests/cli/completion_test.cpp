// Completion and manual come from the argument tree: what the shells themselves and man make of
// them.
#include <initializer_list>
#include <span>

#include <gmock/gmock.h>

#include "support/program.h"
#include "support/typed_shell.h"

namespace sinerig {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Completion : public testing::Test {
 protected:
  void SetUp() override {
    for (const char* name : {"gimbal.toml", "gimbal.sweep", "gimbal.txt.orig", "my night.toml"})
      workshop_.write(name, "");
    workshop_.shell("mkdir geometry");
  }

  // Where the package puts the script, as the shell finds it there.
  void install(const std::string& shell, const std::string& name) {
    workshop_.write(name, workshop_.sinerig("completion " + shell).output);
  }

  bool here(const std::string& program) const {
    return workshop_.shell("command -v " + program).exit_code == 0;
  }

  test::Workshop workshop_;
};

// What a line becomes: keys, then the arguments that the command is called with. ^T puts all that
// the shell offers into the line.
struct Line {
  const char* keys;
  const char* arguments;
};

void expect_lines(test::TypedShell& shell, std::span<const Line> lines) {
  for (const Line& line : lines) {
    EXPECT_EQ(shell.arguments_after(line.keys), line.arguments) << line.keys;
  }
}

constexpr Line completed_everywhere[] = {
    {"sinerig ru\t", "|run"},
    {"sinerig doc\t", "|doctor"},
    {"sinerig run --se\t", "|run|--serve"},
    {"sinerig doctor --str\t", "|doctor|--strict"},
    {"sinerig export gimbal.sweep --format sn\t", "|export|gimbal.sweep|--format|snippet"},
    {"sinerig run gim\t", "|run|gimbal.toml"},
    {"sinerig plan gim\t", "|plan|gimbal.toml"},
    {"sinerig doctor gim\t", "|doctor|gimbal.toml"},
    {"sinerig night my\t", "|night|my night.toml"},
    {"sinerig report gim\t", "|report|gimbal.sweep"},
    {"sinerig resume gim\t", "|resume|gimbal.sweep"},
    {"sinerig completion f\t", "|completion|fish"},
    {"sinerig export --format \x14", "|export|--format|csv|json|mat|snippet|uff"},
    {"sinerig co\x14", "|compare|completion"},
};

TEST_F(Completion, BashCompletesAtItsPrompt) {
  if (!here("bash")) GTEST_SKIP() << "no bash here";
  install("bash", "sinerig.bash");
  test::TypedShell bash{{"bash", "--norc", "--noprofile", "-i"}, workshop_.folder()};
  bash.run("source ./sinerig.bash");
  bash.run("bind '\"\\C-t\": insert-completions'");
  expect_lines(bash, completed_everywhere);
  EXPECT_EQ(bash.arguments_after("sinerig run geo\t"), "|run|geometry/");
  // The value of an option that stands before the command is not the command.
  EXPECT_EQ(bash.arguments_after("sinerig --log-level debug run --se\t"),
            "|--log-level|debug|run|--serve");
  EXPECT_EQ(bash.arguments_after("sinerig --log-level=debug run gim\t"),
            "|--log-level=debug|run|gimbal.toml");
  EXPECT_EQ(bash.arguments_after("sinerig --log-level deb\t"), "|--log-level|debug");
  EXPECT_EQ(bash.arguments_after("sinerig doctor --\x14"),
            "|doctor|--help|--json|--log-level|--seconds|--strict");
}

TEST_F(Completion, ZshCompletesAtItsPrompt) {
  if (!here("zsh")) GTEST_SKIP() << "no zsh here (Debian: apt install zsh)";
  install("zsh", "_sinerig");
  test::TypedShell zsh{{"zsh", "-f", "-i"}, workshop_.folder()};
  for (const char* line : {"fpath=($PWD $fpath)", "autoload -U compinit", "compinit -u -D",
                           "zle -C all-matches complete-word _generic", "bindkey '^T' all-matches",
                           "zstyle ':completion:all-matches::::' completer _all_matches _complete",
                           "zstyle ':completion:all-matches:*' insert true"})
    zsh.run(line);
  expect_lines(zsh, completed_everywhere);
  // Its slash goes when the line is done.
  EXPECT_EQ(zsh.arguments_after("sinerig run geo\t"), "|run|geometry");
  EXPECT_EQ(zsh.arguments_after("sinerig doctor --\x14"),
            "|doctor|--help|--json|--log-level|--seconds|--strict");
}

// fish says what it would offer without a terminal: a word a line, its description behind a tab.
TEST_F(Completion, FishOffersTheSame) {
  if (!here("fish")) GTEST_SKIP() << "no fish here (Debian: apt install fish)";
  install("fish", "sinerig.fish");
  for (const Line& line : std::initializer_list<Line>{
           {"sinerig ru", "run"},
           {"sinerig co", "compare completion"},
           {"sinerig run --se", "--serve"},
           {"sinerig doctor --", "--help --json --log-level --seconds --strict"},
           {"sinerig export --format ", "csv json mat snippet uff"},
           {"sinerig run gim", "gimbal.toml"},
           {"sinerig night my", "my night.toml"},
           {"sinerig report gim", "gimbal.sweep"},
           {"sinerig run geo", "geometry/"},
           {"sinerig completion f", "fish"}}) {
    const auto offered =
        workshop_.shell("HOME=$PWD fish --no-config -c 'source sinerig.fish; complete -C \"" +
                        std::string{line.keys} + "\"' | cut -f 1 | sort | paste -s -d ' '");
    EXPECT_EQ(offered.output, std::string{line.arguments} + "\n") << line.keys << offered.errors;
  }
}

TEST_F(Completion, KnowsThreeShells) {
  EXPECT_EQ(workshop_.sinerig("completion tcsh").exit_code, 2);
}

TEST_F(Completion, ManualHoldsEveryCommandAndIsGoodRoff) {
  const std::string page = workshop_.sinerig("manual").output;
  workshop_.write("sinerig.1", page);
  EXPECT_THAT(page,
              AllOf(HasSubstr(".SS \"notch FILE... [OPTION...]\""), HasSubstr("\\-\\-serve"),
                    HasSubstr(".SS \"doctor [RIG] [OPTION...]\""), HasSubstr(".SH EXIT STATUS")));
  if (!here("groff")) GTEST_SKIP() << "no groff here to read the page (Debian: apt install groff)";
  const auto read = workshop_.shell("groff -man -Tutf8 -ww sinerig.1");
  EXPECT_EQ(read.errors, "");
  EXPECT_THAT(read.output, HasSubstr("sinerig run config/gimbal.toml"));
}

}  // namespace
}  // namespace sinerig
