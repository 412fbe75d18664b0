// sinerig fit: what it refuses, and in which words; the keys of its JSON.
#include <algorithm>
#include <cmath>
#include <complex>
#include <cstdio>
#include <fstream>
#include <iterator>
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
               const std::string& arguments = "--zeros 0 --poles 1", int exit_code = 2) {
    const auto run = fit(csv, arguments);
    EXPECT_EQ(run.exit_code, exit_code) << csv;
    EXPECT_THAT(run.errors, HasSubstr(message));
    EXPECT_EQ(run.output, "");
  }

  // What the file holds, not what was asked of it.
  void refuses_file(const std::string& csv, const std::string& message) {
    refuses(csv, message, "--zeros 0 --poles 1", 1);
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

// The same figures as those of a file that says so at every point.
TEST_F(FitCommand, TakesTheModelErrorForTheScatterWhereThereIsNone) {
  std::string bare = lag_csv();
  std::string cut;
  for (std::size_t begin = 0; begin < bare.size(); begin = bare.find('\n', begin) + 1)
    cut += bare.substr(begin, bare.rfind(',', bare.find('\n', begin)) - begin) + "\n";
  const auto with = fit(lag_csv(), "--zeros 0 --poles 1 --json");
  const auto without = fit(cut, "--zeros 0 --poles 1 --json --model-error 1e-3");
  ASSERT_EQ(without.exit_code, 0) << without.errors;
  EXPECT_EQ(without.errors, "");
  const json expected = json::parse(with.output);
  const json model = json::parse(without.output);
  EXPECT_TRUE(model["scatter_known"].get<bool>());
  EXPECT_EQ(model["model_error"], 1e-3);
  const double error = expected["delay_standard_error"].get<double>();
  EXPECT_NEAR(model["delay_standard_error"].get<double>(), error, 1e-3 * error);
  const auto silent = fit(cut, "--zeros 0 --poles 1 --json");
  EXPECT_THAT(silent.errors, HasSubstr("response.csv holds no scatter: intervals come from"));
  EXPECT_FALSE(json::parse(silent.output)["scatter_known"].get<bool>());
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
  refuses_file(
      "1,1,0\n3,0.9,-0.1\n2,0.8,-0.2\n4,0.7,-0.2\n",
      "response.csv:3: 2 Hz comes after 3 Hz: the frequencies must ascend; sort the lines");
  refuses_file(
      "1,1,0\n2,0.9,-0.1\n2,0.8,-0.2\n4,0.7,-0.2\n",
      "response.csv:3: 2 Hz: the frequency occurs twice; merge the two points or remove one");
  refuses_file("0,1,0\n2,0.9,-0.1\n3,0.8,-0.2\n",
               "response.csv:1: the frequency is 0 Hz, but it must be above zero");
}

TEST_F(FitCommand, RefusesWhatIsNoResponse) {
  refuses_file("1,1,0\n2,nan,-0.1\n3,0.8,-0.2\n", "response.csv:2: re is nan, not finite");
  refuses_file("1,1,0\n2,0.9,\n3,0.8,-0.2\n", "response.csv:2: no value for im");
  refuses("1,0,0\n2,0,0\n3,0,0\n", "every point is zero; check that the right channels");
  refuses("1,1,0\n2,0,0\n3,1,0\n", "the response is exactly zero");
  refuses_file("1,1,0\n2,one,0\n", "response.csv:2: re is \"one\"; wanted a number");
  refuses_file("1,1\n", "fewer than three columns");
  refuses("1,1,0\n2,0.9,-0.2,0.01\n3,0.8,-0.2,0.01\n", "given for every point or for none");
  refuses_file("0,5;0,2;-0,1\n1,5;0,2;-0,1\n",
               "response.csv:1: the numbers have decimal commas; write points");
  refuses_file("freq_hz;re;im\n0,5;0,2;-0,1\n", "response.csv:2: the numbers have decimal commas");
  refuses("1,1,0\n", "response.csv: response: 1 points");
  refuses_file("", "holds no points; wanted lines of freq_hz,re,im[,std]");
  refuses_file("freq_hz,re\n1,1\n", "the header has no column im");
}

TEST_F(FitCommand, SuspectsWrongUnits) {
  refuses_file(
      "freq,re,im\n1,1,0\n",
      "the header has no column freq_hz (frequency in Hz) and none omega_rad_s (in rad/s)");
  refuses_file("1,1,0,40\n2,0.9,-0.1,40\n3,0.8,-0.2,40\n", "not in dB or per cent");
  refuses_file("1,1,0,-1\n", "std is below zero");
  const std::string bode = "1,-3,-40\n2,-10,-80\n4,-20,-120\n8,-31,-150\n16,-43,-165\n";
  refuses_file(bode, "re and im look like gain in dB and phase in degrees");
  EXPECT_EQ(fit(bode, "--zeros 0 --poles 1 --delay none --trust-units").exit_code, 0);
}

TEST_F(FitCommand, ReadsWhatOtherProgramsWrite) {
  const auto num = [&](const std::string& csv) {
    const auto run = fit(csv, "--zeros 0 --poles 1 --delay none --json");
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return run.exit_code == 0 ? json::parse(run.output)["num"][0].get<double>() : 0.0;
  };
  // 100/(s + 100), at 100 rad/s and the powers of two about it.
  std::string bode =
      "\xEF\xBB\xBF"
      "omega_rad_s;gain_db;phase_deg;remark\r\n";
  std::string table = "remark\tim\tre\tfreq_hz\r\n";
  for (double omega = 25.0; omega <= 400.0; omega *= 2.0) {
    const std::complex<double> H = 100.0 / std::complex<double>{100.0, omega};
    char line[160];
    std::snprintf(line, sizeof line, "%.17g;%.17g;%.17g;x\r\n", omega,
                  20.0 * std::log10(std::abs(H)), std::arg(H) * 360.0 / turn);
    bode += line;
    std::snprintf(line, sizeof line, "x\t%.17g\t%.17g\t%.17g\r\n", H.imag(), H.real(),
                  omega / turn);
    table += line;
  }
  EXPECT_NEAR(num(bode), 100.0, 1e-9);
  EXPECT_NEAR(num(table), 100.0, 1e-9);
}

TEST_F(FitCommand, ThePapersMethodsGiveStandardErrorsToo) {
  for (const std::string method : {"hassul", "hassul --weights 1/w", "choe"}) {
    const auto run = fit(lag_csv(), "--zeros 0 --poles 1 --delay 0.002 --json --method " + method);
    ASSERT_EQ(run.exit_code, 0) << run.errors;
    const json model = json::parse(run.output);
    EXPECT_EQ(model["den"][0].get<double>(), 1.0);
    EXPECT_NEAR(model["den"][1].get<double>(), 100.0, 1e-7);
    EXPECT_TRUE(model["converged"].get<bool>());
    EXPECT_LT(model["chi2"].get<double>(), 1e-6);
    EXPECT_GT(model["den_standard_error"][1].get<double>(), 0.0);
    EXPECT_EQ(model.contains("choe"), method == "choe");
  }
}

// With weights that differ by orders of magnitude the answer tells which of them were used.
TEST_F(FitCommand, TakesWeightsFromAListAFileAColumnOrAFunction) {
  std::string csv = "freq_hz,re,im,weight\n";
  std::string list;
  std::string file = "weight\n";
  for (int i = 1; i <= 6; ++i) {
    const double omega = 25.0 * i;
    const std::complex<double> s{0.0, omega};
    const std::complex<double> H = 200.0 / (s + 100.0) + 0.01 * i * i;
    const double weight = std::abs(1.0 / (s + 50.0));
    char line[160];
    std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.17g\n", omega / turn, H.real(), H.imag(),
                  weight);
    csv += line;
    std::snprintf(line, sizeof line, "%.17g", weight);
    if (!list.empty()) list.append(",");
    list.append(line);
    file.append(line).append("\n");
  }
  workshop_.write("weights.txt", file);
  const auto pole = [&](const std::string& weights) {
    const auto run = fit(csv, "--zeros 0 --poles 1 --method hassul --json " + weights);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    return run.exit_code == 0 ? json::parse(run.output)["den"][1].get<double>() : 0.0;
  };
  const double by_column = pole("--weights column");
  EXPECT_GT(std::abs(by_column - pole("")), 1e-3);
  EXPECT_NEAR(pole("--weights " + list), by_column, 1e-9 * by_column);
  EXPECT_NEAR(pole("--weights weights.txt"), by_column, 1e-9 * by_column);
  EXPECT_NEAR(pole("--weight-num 1 --weight-den 1,50"), by_column, 1e-9 * by_column);
  refuses(csv, "--weights: 2 numbers for 6 points",
          "--zeros 0 --poles 1 --method hassul --weights 1,2");
  refuses(csv, "belong together", "--zeros 0 --poles 1 --method hassul --weight-num 1");
  refuses(csv, "--weights belongs to --method hassul", "--zeros 0 --poles 1 --weights 1/w");
}

TEST_F(FitCommand, GivesSectionsStateSpaceAndDiscreteFormsWithErrors) {
  const auto run = fit(lag_csv(), "--zeros 0 --poles 1 --json --discrete zoh --rate 800");
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json model = json::parse(run.output);
  EXPECT_NEAR(model["sections"][0]["den"][2].get<double>(), 100.0, 1e-6);
  EXPECT_NEAR(model["sections"][0]["den_standard_error"][2].get<double>(),
              model["den_standard_error"][1].get<double>(), 1e-5);
  EXPECT_NEAR(model["state_space"]["A"][0][0].get<double>(), -100.0, 1e-6);
  EXPECT_GT(model["state_space"]["standard_error"]["B"][0].get<double>(), 0.0);
  // The pole e^−0.125; the delay of 1.6 ticks adds one at 0.
  const json& discrete = model["discrete"];
  EXPECT_NEAR(discrete["den"][1].get<double>(), -std::exp(-0.125), 1e-7);
  const double period_s = 1.0 / 800.0;
  EXPECT_NEAR(discrete["den_standard_error"][1].get<double>(),
              period_s * std::exp(-0.125) * model["den_standard_error"][1].get<double>(), 1e-7);
  refuses(lag_csv(), "--discrete needs the rate", "--zeros 0 --poles 1 --discrete tustin");
}

TEST_F(FitCommand, RefusesOptionsThatMakeNoSense) {
  refuses(lag_csv(), "--delay is \"soon\"; wanted none, fit or seconds",
          "--zeros 0 --poles 1 --delay soon");
  refuses(lag_csv(), "--method hassul needs the orders", "--method hassul");
  refuses(lag_csv(), "--hold: the rate must be above zero", "--zeros 0 --poles 1 --hold=-5");
  const auto absent = workshop_.sinerig("fit nowhere.csv");
  EXPECT_EQ(absent.exit_code, 1);
  EXPECT_THAT(absent.errors, HasSubstr("nowhere.csv: cannot be read"));
}

TEST_F(FitCommand, RefusesWhatTheMethodCannotKeepTo) {
  const std::string orders = "--zeros 0 --poles 1 --method ";
  for (const std::string method : {"hassul", "choe"})
    for (const std::string option :
         {"--stable", "--minimum-phase", "--given-pole -100", "--static-gain 3"})
      refuses(lag_csv(), option.substr(0, option.find(' ')) + " belongs to --method ml",
              orders + method + " " + option);
  for (const std::string method : {"hassul", "ml"})
    refuses(lag_csv(), "--bands belongs to --method choe", orders + method + " --bands 3");
}

// 1/(s (s/100 + 1)) is not one with two poles anywhere: left out, their place is chosen.
TEST_F(FitCommand, ChoosesThePolesAtTheOriginBesideGivenOrders) {
  std::string csv = "freq_hz,re,im,std\n";
  for (int i = 0; i < 30; ++i) {
    const double hz = std::pow(10.0, i / 14.5);
    const std::complex<double> s{0.0, turn * hz};
    const std::complex<double> H = 1.0 / (s * (s / 100.0 + 1.0));
    char line[160];
    std::snprintf(line, sizeof line, "%.17g,%.17g,%.17g,%.6g\n", hz, H.real(), H.imag(),
                  1e-3 * std::abs(H));
    csv += line;
  }
  const auto origin = [&](const std::string& arguments) {
    const auto run = fit(csv, "--zeros 0 --poles 2 --json " + arguments);
    EXPECT_EQ(run.exit_code, 0) << run.errors;
    const json model = json::parse(run.output);
    return std::count(model["poles"].begin(), model["poles"].end(), json::array({0.0, 0.0}));
  };
  EXPECT_EQ(origin(""), 1);
  EXPECT_EQ(origin("--origin 0"), 0);
}

TEST_F(FitCommand, ChoeTakesTheSubBandsThatTheSweepPlanned) {
  std::ifstream file{SINERIG_SOURCE_DIR "/config/chebyshev.toml"};
  std::string rig{std::istreambuf_iterator<char>{file}, {}};
  const std::size_t points = rig.find("\npoints = ");
  ASSERT_NE(points, std::string::npos);
  rig.replace(points, rig.find('\n', points + 1) - points, "\npoints = 12\nsub_bands = 4");
  workshop_.write("bands.toml", rig);
  const auto plan = workshop_.sinerig("plan bands.toml");
  EXPECT_THAT(plan.output, HasSubstr("sub-band 4: points 35 to 45"));
  ASSERT_EQ(workshop_.sinerig("run bands.toml --no-report").exit_code, 0);
  const std::string command = "fit bands.sweep --method choe --zeros 0 --poles 3 --json ";
  const auto run = workshop_.sinerig(command);
  ASSERT_EQ(run.exit_code, 0) << run.errors;
  const json bands = json::parse(run.output)["choe"]["bands"];
  ASSERT_EQ(bands.size(), 4U);
  EXPECT_EQ(bands[0]["points"].get<int>(), 12);
  EXPECT_EQ(bands[3]["points"].get<int>(), 11);
  EXPECT_EQ(json::parse(workshop_.sinerig(command + "--bands 2").output)["choe"]["bands"].size(),
            2U);
}

}  // namespace
}  // namespace sinerig
