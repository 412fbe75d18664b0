// Completion and manual come from the argument tree: what the shells and man make of them.
#include <gmock/gmock.h>

#include "support/program.h"

namespace sinerig {
namespace {

using testing::AllOf;
using testing::HasSubstr;

class Completion : public testing::Test {
 protected:
  // What bash would offer for these words; the last one is being typed.
  std::string offered(const std::string& words, int at) {
    return workshop_
        .shell("bash -c 'source <(" SINERIG_BINARY " completion bash); COMP_WORDS=(" + words +
               "); COMP_CWORD=" + std::to_string(at) + "; _sinerig; echo ${COMPREPLY[*]}'")
        .output;
  }
  bool here(const std::string& program) const {
    return workshop_.shell("command -v " + program).exit_code == 0;
  }

  test::Workshop workshop_;
};

TEST_F(Completion, BashOffersCommandsOptionsValuesAndFiles) {
  EXPECT_EQ(offered("sinerig co", 1), "compare completion\n");
  EXPECT_EQ(offered("sinerig export --format \"\"", 3), "csv json mat uff snippet\n");
  EXPECT_EQ(offered("sinerig run --se", 2), "--serve\n");
  workshop_.write("gimbal.toml", "");
  workshop_.write("gimbal.sweep", "");
  workshop_.write("gimbal.txt.orig", "");
  EXPECT_EQ(offered("sinerig run gim", 2), "gimbal.toml\n");
  EXPECT_EQ(offered("sinerig doc", 1), "doctor\n");
  EXPECT_EQ(offered("sinerig doctor --str", 2), "--strict\n");
  EXPECT_EQ(offered("sinerig doctor gim", 2), "gimbal.toml\n");
  EXPECT_EQ(offered("sinerig report gim", 2), "gimbal.sweep\n");
}

TEST_F(Completion, ZshAndFishTakeTheirScripts) {
  for (const char* shell : {"zsh", "fish"}) {
    const auto script = workshop_.sinerig(std::string{"completion "} + shell);
    ASSERT_EQ(script.exit_code, 0);
    EXPECT_THAT(script.output, AllOf(HasSubstr("margins"), HasSubstr("toml"),
                                     HasSubstr("csv json mat uff snippet")));
    if (!here(shell)) continue;  // its syntax can only be told by itself
    workshop_.write("script", script.output);
    EXPECT_EQ(workshop_.shell(std::string{shell} + " -n script").exit_code, 0) << shell;
  }
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
