#include "crash/child.h"

#include <algorithm>
#include <csignal>
#include <cstdlib>
#include <fcntl.h>
#include <fstream>
#include <iterator>
#include <poll.h>
#include <stdexcept>
#include <unistd.h>

#include <nlohmann/json.hpp>
#include <sys/wait.h>

namespace sinerig::test {

namespace {

void take_line(const std::string& line, std::vector<ToldPoint>& points) {
  const auto json = nlohmann::json::parse(line, nullptr, false);
  if (json.is_discarded() || json.value("type", "") != "point") return;
  const auto number = [&](const char* key) {
    return json.at(key).is_number() ? json.at(key).get<double>() : 0.0;
  };
  points.push_back({.dwell = json.at("dwell").get<std::uint32_t>(),
                    .output = json.at("output").get<std::string>(),
                    .freq_hz = number("freq_hz"),
                    .re = number("re"),
                    .im = number("im")});
}

[[noreturn]] void become(const std::string& program, const std::vector<std::string>& arguments,
                         const std::string& folder, const std::string& orders, int out) {
  if (!orders.empty()) setenv("SINERIG_FAULTY_DISK", orders.c_str(), 1);
  const int null = open("/dev/null", O_RDONLY);
  dup2(null, STDIN_FILENO);
  dup2(out, STDOUT_FILENO);
  if (chdir(folder.c_str()) != 0) _exit(126);
  const int err = open("errors.txt", O_WRONLY | O_CREAT | O_TRUNC | O_CLOEXEC, 0600);
  dup2(err, STDERR_FILENO);
  std::vector<std::string> words = arguments;
  words.insert(words.begin(), program);
  std::vector<char*> argv;
  for (std::string& word : words) argv.push_back(word.data());
  argv.push_back(nullptr);
  execv(program.c_str(), argv.data());
  _exit(127);
}

}  // namespace

ChildEnd run_child(const std::string& program, const std::vector<std::string>& arguments,
                   const std::string& folder, const std::string& orders,
                   std::optional<std::chrono::microseconds> kill_after) {
  using Clock = std::chrono::steady_clock;
  int ends[2] = {};
  if (pipe2(ends, O_CLOEXEC) != 0) throw std::runtime_error("no pipe");
  const Clock::time_point start = Clock::now();
  const pid_t child = fork();
  if (child == 0) become(program, arguments, folder, orders, ends[1]);
  close(ends[1]);

  std::string text;
  bool killed = false;
  while (true) {
    int wait_ms = -1;
    if (kill_after && !killed) {
      const auto left = *kill_after - (Clock::now() - start);
      if (left <= Clock::duration::zero()) {
        kill(child, SIGKILL);
        killed = true;
      } else {
        wait_ms = static_cast<int>(std::chrono::ceil<std::chrono::milliseconds>(left).count());
      }
    }
    pollfd pipe_end{.fd = ends[0], .events = POLLIN, .revents = 0};
    if (poll(&pipe_end, 1, wait_ms) == 0) continue;
    char buffer[4096];
    const ssize_t got = read(ends[0], buffer, sizeof buffer);
    if (got <= 0) break;
    text.append(buffer, static_cast<std::size_t>(got));
  }
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);

  ChildEnd end;
  end.seconds = std::chrono::duration<double>(Clock::now() - start).count();
  end.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
  for (std::size_t at = 0, next = 0; (next = text.find('\n', at)) != std::string::npos;
       at = next + 1) {
    take_line(text.substr(at, next - at), end.points);
  }
  std::ifstream errors{folder + "/errors.txt"};
  end.errors.assign(std::istreambuf_iterator<char>{errors}, {});
  return end;
}

}  // namespace sinerig::test
