// sinerig fit: what it refuses, and in which words; the keys of its JSON.
#include <cmath>
#include <complex>
#include <cstdio>
#include <numbers>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>
#include <nlohmann/json.hpp>

#include "support/program.h"

namespace sinerig {
namespace {

using nlohmann::json;
using testing::HasSubstr;

constexpr double turn = 2.0 * std::numbers::pi;

class FitCommand : public testing::Test {
 protected:
  // 40 exact points of 300/(s + 100) with 2 ms of delay, each with a deviation of 0.1 %.
  static std::string lag_csv() {
    std::string text = "freq_hz,re,im,std\n";
    for (int i = 0; i < 40; ++i) {
      const double hz = std::pow(10.0, i / 19.5);
      const std::complex<double> s{0.0, turn * hz};
      const std::complex<double> H = 300.0 / (s + 100.0) * std::exp(-2e-3 * s);
      char line[160];
      std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.6g\n", hz, H.real(), H.imag(),
                    1e-3 * std::abs(H));
      text += line;
    }
    return text;
  }

  test::Finished fit(const std::string& csv, const std::string& arguments = "") {
    workshop_.write("response.csv", csv);
    return workshop_.sinerig("fit response.csv " + arguments);
  }

  void refuses(const std::string& csv, const std::string& message,
               const std::string& arguments = "--zeros 0 --poles 1") {
    const auto run = fit(csv, arguments);
    EXPECT_EQ(run.exit_code, 2) << csv;
    EXPECT_THAT(run.errors, HasSubstr(message));
    EXPECT_EQ(run.output, "");
  }

  test::Workshop workshop_;
};

TEST_F(FitCommand, PrintsOneJsonObjectWithStandardErrors) {
  const auto run = fit(lag_csv(), "--zeros 0 --poles 1 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json model = json::parse(run.output);
  ASSERT_EQ(model.at("num").size(), 1U);
  EXPECT_NEAR(model["num"][0].get<double>(), 300.0, 1e-6);
  ASSERT_EQ(model.at("den").size(), 2U);
  EXPECT_EQ(model["den"][0].get<double>(), 1.0);
  EXPECT_NEAR(model["den"][1].get<double>(), 100.0, 1e-6);
  EXPECT_NEAR(model.at("delay_s").get<double>(), 2e-3, 1e-10);
  EXPECT_LT(model.at("chi2").get<double>(), 1e-6);
  EXPECT_TRUE(model.at("converged").get<bool>());
  EXPECT_EQ(model.at("num_standard_error").size(), 1U);
  EXPECT_GT(model["num_standard_error"][0].get<double>(), 0.0);
  EXPECT_EQ(model.at("den_standard_error").size(), 2U);
  EXPECT_EQ(model["den_standard_error"][0].get<double>(), 0.0);
  EXPECT_GT(model["den_standard_error"][1].get<double>(), 0.0);
  EXPECT_GT(model.at("delay_standard_error").get<double>(), 0.0);
  EXPECT_EQ(model.at("covariance").size(), 4U);
}

TEST_F(FitCommand, ChoosesTheOrderByItselfAndShowsTheCandidates) {
  const auto run = fit(lag_csv(), "--order auto --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json model = json::parse(run.output);
  EXPECT_EQ(model["den"].size(), 2U);
  EXPECT_GT(model.at("candidates").size(), 1U);
}

TEST_F(FitCommand, FitsSeveralFilesJointlyAndTakesAKnownDelay) {
  workshop_.write("again.csv", lag_csv());
  const auto run = fit(lag_csv(), "again.csv --zeros 0 --poles 1 --delay 0.002 --json");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  EXPECT_EQ(json::parse(run.output)["delay_s"].get<double>(), 0.002);
}

TEST_F(FitCommand, RefusesTooFewPointsForTheOrder) {
  refuses("1,1,0\n2,0.9,-0.1\n", "2 points, but the model asked for needs at least",
          "--zeros 2 --poles 5");
}

TEST_F(FitCommand, RefusesFrequenciesOutOfOrderOrTwice) {
  refuses("1,1,0\n3,0.9,-0.1\n2,0.8,-0.2\n4,0.7,-0.2\n",
          "response point 3 (2 Hz): the frequencies must ascend; sort the points");
  refuses("1,1,0\n2,0.9,-0.1\n2,0.8,-0.2\n4,0.7,-0.2\n",
          "response point 3 (2 Hz): the frequency occurs twice");
  refuses("0,1,0\n2,0.9,-0.1\n3,0.8,-0.2\n", "the frequency must be finite and above zero");
}

TEST_F(FitCommand, RefusesWhatIsNoResponse) {
  refuses("1,1,0\n2,nan,-0.1\n3,0.8,-0.2\n", "response point 2 (2 Hz): the response is not finite");
  refuses("1,0,0\n2,0,0\n3,0,0\n", "every point is zero; check that the right channels");
  refuses("1,1,0\n2,0,0\n3,1,0\n", "the response is exactly zero");
  refuses("1,1,0\n2,one,0\n", "response.csv:2: re is \"one\"; wanted a number");
  refuses("1,1\n", "fewer than three columns");
  refuses("", "holds no points; wanted lines of freq_hz,re,im[,std]");
}

TEST_F(FitCommand, SuspectsWrongUnits) {
  refuses("freq,re,im\n1,1,0\n",
          "the header has no column freq_hz; wanted freq_hz (Hz, not rad/s)");
  refuses("1,1,0,40\n2,0.9,-0.1,40\n3,0.8,-0.2,40\n", "not in dB or per cent");
  refuses("1,1,0,-1\n", "std is below zero");
}

TEST_F(FitCommand, RefusesOptionsThatMakeNoSense) {
  refuses(lag_csv(), "--delay is \"soon\"; wanted none, fit or seconds",
          "--zeros 0 --poles 1 --delay soon");
  refuses(lag_csv(), "--method hassul needs the orders", "--method hassul");
  refuses(lag_csv(), "--hold", "--zeros 0 --poles 1 --hold 0");
  const auto absent = workshop_.sinerig("fit nowhere.csv");
  EXPECT_EQ(absent.exit_code, 2);
  EXPECT_THAT(absent.errors, HasSubstr("nowhere.csv: cannot be read"));
}

}  // namespace
}  // namespace sinerig
