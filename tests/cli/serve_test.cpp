// `sinerig run --serve` as a user has it: an address on standard error, a Stop that ends the run.
#include <fstream>
#include <sstream>
#include <unistd.h>

#include <gmock/gmock.h>
#include <nlohmann/json.hpp>

#include "support/http_client.h"
#include "support/process.h"

namespace sinerig {
namespace {

using testing::HasSubstr;

// An hour of real time unless it is stopped.
constexpr const char* slow_rig =
    "[loop]\nrate_hz = 100\nclock = \"monotonic\"\n"
    "[sweep]\nspacing = \"list\"\nfrequencies_hz = [5]\namplitude = 0.5\nsettling = \"fixed\"\n"
    "settle_s = 3600\n[limits]\n[actuator]\n[sensor.gyro]\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";

constexpr const char* fast_rig =
    "[loop]\nrate_hz = 1000\n[sweep]\nstart_hz = 5\nstop_hz = 50\npoints = 5\namplitude = 0.5\n"
    "[limits]\n[actuator]\n[sensor.gyro]\nnoise_rms = 1e-3\n"
    "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";

class Serve : public test::ProgramTest {
 protected:
  Serve() {
    write("slow.toml", slow_rig);
    write("fast.toml", fast_rig);
  }
};

TEST_F(Serve, StopEndsTheRunAsCtrlCDoes) {
  test::Program program{{"run", "slow.toml", "--serve", ":0", "--json"}, folder_};
  const std::string url = nlohmann::json::parse(program.read_line())["live_page"];
  ASSERT_EQ(url.rfind("http://127.0.0.1:", 0), 0U) << url;
  const auto port = static_cast<std::uint16_t>(std::stoi(url.substr(17)));
  const std::string token = url.substr(url.find("token=") + 6);
  EXPECT_EQ(test::HttpClient{port}.post("/stop").status(), "403");
  EXPECT_EQ(test::HttpClient{port}.post("/stop", "X-Sinerig-Token: " + token + "\r\n").status(),
            "204");
  const auto finished = program.finish();
  EXPECT_EQ(finished.code, 4) << finished.err;
  const auto end =
      nlohmann::json::parse(finished.out.substr(finished.out.rfind("{\"type\":\"end\"")));
  EXPECT_EQ(end["outcome"], "interrupted");
}

TEST_F(Serve, ServingChangesNoNumberAndStoresNoSample) {
  ASSERT_EQ(run({"run", "fast.toml", "-o", "plain.sweep"}).code, 0);
  const auto served = run({"run", "--serve", ":0", "fast.toml", "-o", "served.sweep"});
  ASSERT_EQ(served.code, 0) << served.err;
  EXPECT_EQ(run({"export", "plain.sweep"}).out, run({"export", "served.sweep"}).out);
  EXPECT_THAT(served.err, HasSubstr("on a virtual clock the run is over at once"));
}

TEST_F(Serve, RefusesAnAddressBeforeAnythingMoves) {
  const auto wrong = run({"run", "fast.toml", "--serve=gimbal.local:80"});
  EXPECT_EQ(wrong.code, 2);
  EXPECT_THAT(wrong.err, HasSubstr("\"gimbal.local\" is no numeric address"));
  EXPECT_FALSE(std::filesystem::exists(path("fast.sweep")));
}

// Local addresses of the sockets that a process listens on, as /proc has them.
std::vector<std::string> listening(const std::string& process) {
  std::vector<std::string> found;
  for (const char* table : {"tcp", "tcp6"}) {
    std::ifstream stream{"/proc/" + process + "/net/" + table};
    std::string line;
    std::getline(stream, line);
    while (std::getline(stream, line)) {
      std::istringstream fields{line};
      std::string slot, local, remote, state, skipped, inode;
      fields >> slot >> local >> remote >> state;
      for (int i = 0; i < 5; ++i) fields >> skipped;
      fields >> inode;
      if (state != "0A") continue;
      for (const auto& entry : std::filesystem::directory_iterator{"/proc/" + process + "/fd"}) {
        std::error_code gone;
        const auto target = std::filesystem::read_symlink(entry.path(), gone).string();
        if (target == "socket:[" + inode + "]") found.push_back(local.substr(0, local.find(':')));
      }
    }
  }
  return found;
}

TEST_F(Serve, ListensOnLoopbackOrNotAtAll) {
  struct Case {
    std::vector<std::string> arguments;
    std::vector<std::string> wanted;
  };
  const std::string loopback = "0100007F";
  for (const Case& each :
       {Case{{"run", "slow.toml", "--json"}, {}},
        Case{{"run", "slow.toml", "--json", "--serve", "0"}, {loopback}},
        Case{{"run", "slow.toml", "--json", "--serve", "0.0.0.0:0"}, {"00000000"}}}) {
    test::Program program{each.arguments, folder_};
    program.read_line();
    EXPECT_EQ(listening(std::to_string(program.pid())), each.wanted);
    program.send(SIGTERM);
    EXPECT_EQ(program.finish().code, 4);
  }
}

}  // namespace
}  // namespace sinerig
