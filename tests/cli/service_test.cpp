// What a service manager hears of a run.
#include <atomic>
#include <chrono>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <functional>
#include <future>
#include <memory>
#include <optional>
#include <poll.h>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <sys/socket.h>
#include <sys/un.h>

#include "cli/commands.h"
#include "cli/service_notifier.h"
#include "drivers/device.h"
#include "record/database.h"
#include "record/sweep_reader.h"
#include "support/fake_rig.h"
#include "support/process.h"

namespace sinerig {
namespace {

using cli::ServiceNotifier;
using testing::Contains;
using testing::ElementsAre;
using testing::HasSubstr;
using testing::StartsWith;

constexpr int patience_ms = 30'000;

// The manager's end of the socket.
class Manager {
 public:
  explicit Manager(std::string path) : path_{std::move(path)} {
    descriptor_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0);
    sockaddr_un address{};
    address.sun_family = AF_UNIX;
    path_.copy(address.sun_path, sizeof address.sun_path - 1);
    if (path_[0] == '@') address.sun_path[0] = '\0';
    const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + path_.size());
    EXPECT_EQ(bind(descriptor_, reinterpret_cast<sockaddr*>(&address), length), 0) << path_;
  }
  ~Manager() {
    close(descriptor_);
    if (path_[0] != '@') unlink(path_.c_str());
  }
  Manager(const Manager&) = delete;
  Manager& operator=(const Manager&) = delete;

  // The next message; empty where none comes in time.
  std::string next(int wait_ms = 0) {
    pollfd waited{.fd = descriptor_, .events = POLLIN, .revents = 0};
    if (poll(&waited, 1, wait_ms) != 1) return "";
    char text[512];
    const ssize_t length = recv(descriptor_, text, sizeof text, 0);
    return {text, static_cast<std::size_t>(std::max<ssize_t>(length, 0))};
  }
  std::vector<std::string> all() {
    std::vector<std::string> messages;
    for (std::string text = next(); !text.empty(); text = next()) messages.push_back(text);
    return messages;
  }

 private:
  std::string path_;
  int descriptor_ = -1;
};

class Service : public test::ProgramTest {
 protected:
  // Short: the path of a socket has room for 107 letters.
  std::string socket_ = "/tmp/sinerig-notify-" + std::to_string(getpid());
};

constexpr ServiceNotifier::Time start{};

TEST_F(Service, IsFedByTheLoopsProgressAndNotByTime) {
  using std::chrono::milliseconds;
  Manager manager{socket_};
  ServiceNotifier service{socket_, std::chrono::seconds{1}};
  service.ready();
  manager.all();
  service.progress(5, start + milliseconds{1000});
  EXPECT_THAT(manager.all(), ElementsAre("WATCHDOG=1"));
  service.progress(6, start + milliseconds{1200});  // within a quarter of the period
  EXPECT_TRUE(manager.all().empty());
  service.progress(7, start + milliseconds{1250});
  EXPECT_THAT(manager.all(), ElementsAre("WATCHDOG=1"));
  for (int n = 0; n < 100; ++n) service.progress(7, start + milliseconds{2000 + 100 * n});
  EXPECT_TRUE(manager.all().empty());
  service.progress(8, start + milliseconds{20'000});
  EXPECT_THAT(manager.all(), ElementsAre("WATCHDOG=1"));
}

TEST_F(Service, HearsOfReadinessStatusAndTheEnd) {
  Manager manager{"@" + socket_};
  ServiceNotifier service{"@" + socket_, {}};
  service.ready();
  service.status("point 1 of 2");
  service.status("point 1 of 2");
  service.status("point 2 of 2");
  service.progress(1, start + std::chrono::hours{1});  // no watchdog was asked for
  service.stopping();
  EXPECT_THAT(manager.all(),
              ElementsAre("READY=1", "STATUS=point 1 of 2", "STATUS=point 2 of 2", "STOPPING=1"));
}

// What the manager counts itself: how long it takes to start and to stop.
TEST_F(Service, IsGivenMoreTimeBeforeItIsReadyAndAfterItsEnd) {
  const std::string longer = "EXTEND_TIMEOUT_USEC=60000000";
  for (const bool watched : {false, true}) {
    const std::string meal = watched ? "WATCHDOG=1" : "";
    const std::string both = watched ? meal + "\n" + longer : longer;
    Manager manager{socket_};
    ServiceNotifier service{socket_, std::chrono::seconds{watched ? 1 : 0}};
    service.progress(1, start + std::chrono::hours{1});
    service.progress(1, start + std::chrono::hours{2});  // stands still
    EXPECT_THAT(manager.all(), ElementsAre(both));
    service.ready();
    manager.all();
    service.progress(2, start + std::chrono::hours{3});
    EXPECT_EQ(manager.next(), meal);
    service.stopping();
    manager.all();
    service.idle(start + std::chrono::hours{4});
    EXPECT_THAT(manager.all(), ElementsAre(both));
  }
}

TEST_F(Service, IsFedByTimeForSoLongAndNoLonger) {
  const cli::SignOfLife time = cli::for_at_most(std::chrono::hours{1});
  const std::uint64_t before = time();
  EXPECT_NE(time(), before);
  const cli::SignOfLife over = cli::for_at_most({});
  EXPECT_EQ(over(), over());
}

TEST_F(Service, IsFedBesideWorkForAsLongAsThatShowsLife) {
  Manager manager{socket_};
  ServiceNotifier service{socket_, std::chrono::milliseconds{20}};
  service.ready();
  EXPECT_EQ(manager.next(), "READY=1");
  std::atomic<std::uint64_t> turns{0};
  const int code = cli::attended(
      service, [&] { return turns.load(); },
      [&] {
        for (int meals = 0; meals < 5; ++meals) {
          ++turns;
          EXPECT_EQ(manager.next(patience_ms), "WATCHDOG=1");
        }
        return 7;
      });
  EXPECT_EQ(code, 7);
}

TEST_F(Service, IsFedByTimeWhereNoLoopIsToRun) {
  using std::chrono::milliseconds;
  Manager manager{socket_};
  ServiceNotifier service{socket_, std::chrono::seconds{1}};
  service.ready();
  service.ready();
  service.progress(5, start + milliseconds{1000});
  service.idle(start + milliseconds{1200});
  service.idle(start + milliseconds{1250});
  service.idle(start + milliseconds{1300});
  EXPECT_THAT(manager.all(), ElementsAre("READY=1", "WATCHDOG=1", "WATCHDOG=1"));
  service.progress(5, start + milliseconds{1600});  // of another loop
  EXPECT_THAT(manager.all(), ElementsAre("WATCHDOG=1"));
}

TEST_F(Service, IsNotMissedWhereThereIsNone) {
  for (const std::string& nowhere :
       {std::string{}, std::string{"relative"}, socket_, "/" + std::string(200, 'x')}) {
    ServiceNotifier service{nowhere, std::chrono::seconds{1}};
    service.ready();
    service.progress(1, start + std::chrono::hours{1});
    service.stopping();
  }
}

TEST_F(Service, IsToldWhereARunIsUntilItIsStopped) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\nclock = \"monotonic\"\n"
        "[sweep]\nspacing = \"list\"\nfrequencies_hz = [50, 0.01]\namplitude = 0.5\n"
        "settling = \"fixed\"\nsettle_cycles = 1\nsettle_s = 0\nintegrate_cycles = 2\n"
        "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
        "[limits]\n[actuator]\n[sensor.y]\n"
        "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n");
  Manager manager{socket_};
  setenv("NOTIFY_SOCKET", socket_.c_str(), 1);
  setenv("WATCHDOG_USEC", "200000", 1);
  test::Program program{{"run", "rig.toml", "--no-report"}, folder_};
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");

  std::string first = manager.next(patience_ms);
  while (first.find("EXTEND_TIMEOUT_USEC=") != std::string::npos) first = manager.next(patience_ms);
  EXPECT_EQ(first, "READY=1");
  std::string last_status;
  for (int meals = 0; meals < 4;) {
    const std::string message = manager.next(patience_ms);
    ASSERT_FALSE(message.empty());
    if (message.rfind("STATUS=", 0) == 0) last_status = message;
    if (message == "WATCHDOG=1") ++meals;
  }
  EXPECT_THAT(last_status, StartsWith("STATUS=point "));
  EXPECT_THAT(last_status, HasSubstr(" of 2, "));
  EXPECT_THAT(last_status, HasSubstr(" left"));
  program.send(SIGTERM);
  EXPECT_EQ(program.finish().code, 4);
  EXPECT_THAT(manager.all(), Contains("STOPPING=1\nWATCHDOG=1"));
}

// Takes its time to be armed, and once more after its fault.
class SlowDevice final : public Device {
 public:
  using Wait = std::function<void(const Waiting&)>;
  explicit SlowDevice(Wait wait) : wait_{std::move(wait)} {}
  void open(const Clock& clock) override {
    actuator_.emplace(clock);
    actuator_->fault_at = [](std::uint64_t tick) {
      return tick == 10 ? Fault::device : Fault::none;
    };
    sensor_.emplace(clock, [](std::uint64_t) { return 0.0; });
  }
  void arm() override { wait_(waiting()); }
  Actuator* actuator() noexcept override { return &*actuator_; }
  Sensor& sensor(std::size_t /*index*/) noexcept override { return *sensor_; }

 private:
  Wait wait_;
  std::optional<test::FakeActuator> actuator_;
  std::optional<test::FakeSensor> sensor_;
};

// A list that waits for longer than the watchdog does, turn by turn.
TEST_F(Service, IsFedWhileADeviceIsArmedAndArmedAgain) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\n[sweep]\nspacing = \"list\"\nfrequencies_hz = [50]\n"
        "amplitude = 0.5\n[retry]\nfaults = 1\nwait_s = 0.01\n[limits]\n[actuator]\n"
        "[sensor.y]\n");
  Manager manager{socket_};
  setenv("NOTIFY_SOCKET", socket_.c_str(), 1);
  setenv("WATCHDOG_USEC", "20000", 1);
  int times_armed = 0;
  const auto wait = [&](const Waiting& waiting) {
    ++times_armed;
    manager.all();
    for (int meals = 0; meals < 8;) {
      waiting.go_on();
      const std::string message = manager.next(patience_ms);
      ASSERT_NE(message, "");
      if (message.starts_with("WATCHDOG=1")) ++meals;
    }
  };
  const DriverKit kit{.name = "sim", .summary = "", .configure = [&](const DeviceRequest&) {
                        return std::make_unique<SlowDevice>(wait);
                      }};
  const int code = cli::run_command(
      {.rig = path("rig.toml"), .output = path("run.sweep"), .report = false}, {kit});
  unsetenv("NOTIFY_SOCKET");
  unsetenv("WATCHDOG_USEC");
  EXPECT_EQ(code, cli::exit_done);
  EXPECT_EQ(times_armed, 2);
}

// A service that ends well before it was ready has failed, to systemd.
TEST_F(Service, IsReadyWhereNothingIsLeftToMeasure) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\n[sweep]\nspacing = \"list\"\nfrequencies_hz = [50]\n"
        "amplitude = 0.5\n[limits]\n[actuator]\n[sensor.y]\n"
        "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n");
  ASSERT_EQ(run({"run", "rig.toml", "--no-report"}).code, 0);
  record::Database{path("rig.sweep"), record::Database::Mode::write}.execute(
      "UPDATE part SET outcome = NULL, finished_utc = NULL; DELETE FROM run WHERE key = 'outcome'");
  Manager manager{socket_};
  setenv("NOTIFY_SOCKET", socket_.c_str(), 1);
  const auto resumed = run({"run", "rig.toml", "--resume", "--no-report"});
  unsetenv("NOTIFY_SOCKET");
  EXPECT_EQ(resumed.code, 0) << resumed.err;
  EXPECT_THAT(resumed.err, HasSubstr("1 of 1 dwells are finished, 0 to go"));
  EXPECT_THAT(manager.all(), ElementsAre("READY=1", "STOPPING=1"));
}

// No sync of a faulty disk returns while it is there.
class HeldDisk {
 public:
  explicit HeldDisk(std::filesystem::path file) : file_{std::move(file)} { std::ofstream{file_}; }
  ~HeldDisk() { std::filesystem::remove(file_); }
  HeldDisk(const HeldDisk&) = delete;
  HeldDisk& operator=(const HeldDisk&) = delete;

 private:
  std::filesystem::path file_;
};

// From the end of the loop on no tick feeds the watchdog, and the disk may take longer than that
// waits.
TEST_F(Service, IsStoppingWhileTheLastPointsWaitForTheDisk) {
  write("rig.toml",
        "[loop]\nrate_hz = 500\nclock = \"monotonic\"\n"
        "[sweep]\nspacing = \"list\"\nfrequencies_hz = [1]\namplitude = 0.5\n"
        "settling = \"fixed\"\nsettle_cycles = 1\nsettle_s = 0\nintegrate_cycles = 2\n"
        "integrate_s = 0\ntarget_db = 0\ntarget_deg = 0\n"
        "[limits]\n[actuator]\n[sensor.y]\n[output]\nmax_lag_s = 100\n"
        "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n");
  Manager manager{socket_};
  const std::string command = "cd '" + folder_.string() + "' && NOTIFY_SOCKET='" + socket_ +
                              "' SINERIG_FAULTY_DISK='hold=held' '" + FAULTY_SINERIG +
                              "' run rig.toml --no-report --quiet 2>errors </dev/null";
  std::future<int> ended =
      std::async(std::launch::async, [&] { return std::system(command.c_str()); });
  EXPECT_EQ(manager.next(patience_ms), "READY=1") << read("errors");
  {
    const HeldDisk held{folder_ / "held"};
    std::string message;
    do {
      message = manager.next(patience_ms);
    } while (!message.empty() && message != "STOPPING=1");
    EXPECT_EQ(message, "STOPPING=1");
    EXPECT_TRUE(record::read_sweep(path("rig.sweep")).responses.empty());
  }
  EXPECT_EQ(WEXITSTATUS(ended.get()), 0) << read("errors");
}

class NightService : public Service {
 protected:
  static std::string rig(const std::string& clock) {
    return "[loop]\nrate_hz = 500\nclock = \"" + clock +
           "\"\n[sweep]\nspacing = \"list\"\nfrequencies_hz = [50]\namplitude = 0.5\n"
           "[limits]\n[actuator]\n[sensor.y]\n"
           "[plant]\nkind = \"transfer_function\"\nnum = [60]\nden = [1, 60]\n";
  }
  void start(Manager& /*listens first*/, const std::string& job) {
    write("night.toml", "[night]\nfolder = \"out\"\n" + job);
    setenv("NOTIFY_SOCKET", socket_.c_str(), 1);
    setenv("WATCHDOG_USEC", "200000", 1);
    program_.emplace(std::vector<std::string>{"night", "night.toml", "--quiet"}, folder_);
    unsetenv("NOTIFY_SOCKET");
    unsetenv("WATCHDOG_USEC");
  }
  std::optional<test::Program> program_;
};

TEST_F(NightService, IsReadyOnceAndStopsAtTheEndOfTheNight) {
  Manager manager{socket_};
  write("rig.toml", rig("virtual"));
  start(manager, "[[night.sweep]]\nrig = \"rig.toml\"\nrepeat = 3\n");
  EXPECT_EQ(manager.next(patience_ms), "READY=1");
  const std::string stopping = "STOPPING=1\nWATCHDOG=1";
  std::string message;
  do {
    message = manager.next(patience_ms);
    ASSERT_FALSE(message.empty());
    EXPECT_NE(message, "READY=1");
  } while (message != stopping);
  EXPECT_TRUE(std::filesystem::exists(path("out/rig-3.sweep")));
  EXPECT_EQ(program_->finish().code, 0);
  for (const std::string& later : manager.all())
    EXPECT_THAT(later, HasSubstr("EXTEND_TIMEOUT_USEC="));
}

TEST_F(NightService, IsFedAndToldWhatItWaitsFor) {
  Manager manager{socket_};
  write("rig.toml", rig("monotonic"));
  start(manager, "[[night.sweep]]\nrig = \"rig.toml\"\nstart_after_s = 100000\n");
  EXPECT_EQ(manager.next(patience_ms), "READY=1");
  EXPECT_THAT(manager.next(patience_ms),
              testing::MatchesRegex("STATUS=waiting until [0-9:]+ for rig-1"));
  for (int meals = 0; meals < 4; ++meals) EXPECT_EQ(manager.next(patience_ms), "WATCHDOG=1");
  program_->send(SIGTERM);
  std::string message;
  do {
    message = manager.next(patience_ms);
    ASSERT_FALSE(message.empty());
  } while (message != "STOPPING=1\nWATCHDOG=1");
  EXPECT_EQ(program_->finish().code, 4);
}

}  // namespace
}  // namespace sinerig
