#include "support/browser.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <fcntl.h>
#include <filesystem>
#include <poll.h>
#include <stdexcept>
#include <string_view>
#include <thread>
#include <unistd.h>

#include <sys/wait.h>

namespace sinerig::test {

namespace {

using Json = nlohmann::json;

// Longest wait for one answer; a machine under load starts Chromium in a few seconds.
constexpr int answer_timeout_ms = 60'000;

// The descriptors at which --remote-debugging-pipe reads and writes.
constexpr int browser_reads = 3;
constexpr int browser_writes = 4;

std::string fresh_folder() {
  std::string name = (std::filesystem::temp_directory_path() / "sinerig-browser-XXXXXX").string();
  if (mkdtemp(name.data()) == nullptr) throw std::runtime_error("no temporary folder");
  return name;
}

std::string decoded(const std::string& base64) {
  std::string bytes;
  unsigned bits = 0;
  int held = 0;
  for (const char each : base64) {
    static const std::string alphabet =
        "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    const std::size_t digit = alphabet.find(each);
    if (digit == std::string::npos) continue;
    bits = bits << 6U | static_cast<unsigned>(digit);
    held += 6;
    if (held >= 8) {
      held -= 8;
      bytes += static_cast<char>(bits >> static_cast<unsigned>(held) & 0xFFU);
    }
  }
  return bytes;
}

}  // namespace

std::optional<std::string> Browser::find() {
  for (const char* path : {"/usr/bin/chromium", "/usr/bin/chromium-browser",
                           "/usr/bin/google-chrome", "/snap/bin/chromium"}) {
    if (access(path, X_OK) == 0) return path;
  }
  return std::nullopt;
}

Browser::Browser(const std::string& program) : profile_{fresh_folder()} {
  std::array<int, 2> requests{};
  std::array<int, 2> answers{};
  if (pipe2(requests.data(), O_CLOEXEC) != 0 || pipe2(answers.data(), O_CLOEXEC) != 0)
    throw std::runtime_error(std::string{"no pipe: "} + std::strerror(errno));
  const std::string profile = "--user-data-dir=" + profile_;
  process_ = fork();
  if (process_ == 0) {
    const int request = fcntl(requests[0], F_DUPFD, 10);
    const int answer = fcntl(answers[1], F_DUPFD, 10);
    dup2(request, browser_reads);
    dup2(answer, browser_writes);
    close(request);
    close(answer);
    const int nothing = ::open("/dev/null", O_WRONLY);
    dup2(nothing, STDOUT_FILENO);
    dup2(nothing, STDERR_FILENO);
    execl(program.c_str(), program.c_str(), "--headless", "--no-sandbox", "--disable-gpu",
          "--disable-quic", "--no-first-run", "--disable-background-networking",
          "--disable-component-update", "--disable-sync", "--hide-scrollbars",
          "--remote-debugging-pipe", profile.c_str(), "about:blank", nullptr);
    _exit(127);
  }
  close(requests[0]);
  close(answers[1]);
  to_browser_ = requests[1];
  from_browser_ = answers[0];
  const Json target = call("Target.createTarget", {{"url", "about:blank"}});
  session_ = call("Target.attachToTarget", {{"targetId", target.at("targetId")}, {"flatten", true}})
                 .at("sessionId")
                 .get<std::string>();
  for (const char* domain : {"Page", "Runtime", "Log"})
    call(std::string{domain} + ".enable", Json::object());
}

Browser::~Browser() {
  kill(process_, SIGTERM);
  for (int i = 0; i < 100 && waitpid(process_, nullptr, WNOHANG) == 0; ++i) {
    std::this_thread::sleep_for(std::chrono::milliseconds{50});
    if (i == 60) kill(process_, SIGKILL);
  }
  close(to_browser_);
  close(from_browser_);
  std::error_code ignored;
  std::filesystem::remove_all(profile_, ignored);
}

void Browser::open(const std::string& url, int width, int height) {
  call("Emulation.setDeviceMetricsOverride",
       {{"width", width}, {"height", height}, {"deviceScaleFactor", 1}, {"mobile", false}});
  errors_.clear();
  loaded_ = false;
  call("Page.navigate", {{"url", url}});
  while (!loaded_) take_note(read_message());
}

void Browser::prefer_dark(bool dark) {
  const Json feature{{"name", "prefers-color-scheme"}, {"value", dark ? "dark" : "light"}};
  call("Emulation.setEmulatedMedia", {{"features", Json::array({feature})}});
}

Json Browser::evaluate(const std::string& expression) {
  const Json answer =
      call("Runtime.evaluate", {{"expression", expression}, {"returnByValue", true}});
  if (answer.contains("exceptionDetails"))
    throw std::runtime_error(expression + ": " + answer["exceptionDetails"].dump());
  return answer.at("result").value("value", Json{});
}

bool Browser::wait_until(const std::string& expression) {
  const std::string promise =
      "new Promise(done => { const end = performance.now() + 30000; const look = () => { if (" +
      expression +
      ") done(true); else if (performance.now() > end) done(false); else setTimeout(look, 20); }; "
      "look(); })";
  for (int loads = 0;; ++loads) {
    try {
      const Json answer =
          call("Runtime.evaluate",
               {{"expression", promise}, {"awaitPromise", true}, {"returnByValue", true}});
      if (answer.contains("exceptionDetails"))
        throw std::runtime_error(expression + ": " + answer["exceptionDetails"].dump());
      return answer.at("result").value("value", false);
    } catch (const std::runtime_error& error) {
      // The page has loaded itself again: look at the new one.
      const bool gone = std::string_view{error.what()}.find("navigated") != std::string_view::npos;
      if (!gone || loads == 5) throw;
    }
  }
}

void Browser::mouse(const char* type, double x, double y, int buttons, int clicks) {
  call("Input.dispatchMouseEvent", {{"type", type},
                                    {"x", x},
                                    {"y", y},
                                    {"button", buttons == 0 && clicks == 0 ? "none" : "left"},
                                    {"buttons", buttons},
                                    {"clickCount", clicks}});
}

void Browser::move_mouse(double x, double y) {
  mouse("mouseMoved", x, y, 0, 0);
}

void Browser::click(double x, double y) {
  move_mouse(x, y);
  mouse("mousePressed", x, y, 1, 1);
  mouse("mouseReleased", x, y, 0, 1);
}

void Browser::double_click(double x, double y) {
  click(x, y);
  mouse("mousePressed", x, y, 1, 2);
  mouse("mouseReleased", x, y, 0, 2);
}

void Browser::drag(double from_x, double from_y, double to_x, double to_y) {
  move_mouse(from_x, from_y);
  mouse("mousePressed", from_x, from_y, 1, 1);
  mouse("mouseMoved", 0.5 * (from_x + to_x), 0.5 * (from_y + to_y), 1, 0);
  mouse("mouseMoved", to_x, to_y, 1, 0);
  mouse("mouseReleased", to_x, to_y, 0, 1);
}

void Browser::press_key(const std::string& key) {
  for (const char* type : {"keyDown", "keyUp"})
    call("Input.dispatchKeyEvent", {{"type", type}, {"key", key}});
}

std::string Browser::screenshot() {
  return decoded(call("Page.captureScreenshot", {{"format", "png"}}).at("data").get<std::string>());
}

Json Browser::call(const std::string& method, const Json& parameters) {
  const int id = next_id_++;
  Json request{{"id", id}, {"method", method}, {"params", parameters}};
  if (!session_.empty()) request["sessionId"] = session_;
  std::string bytes = request.dump();
  bytes.push_back('\0');
  for (std::size_t sent = 0; sent < bytes.size();) {
    const ssize_t count = write(to_browser_, bytes.data() + sent, bytes.size() - sent);
    if (count <= 0) throw std::runtime_error("the browser has gone");
    sent += static_cast<std::size_t>(count);
  }
  while (true) {
    const Json message = read_message();
    if (message.value("id", 0) != id) {
      take_note(message);
      continue;
    }
    if (message.contains("error"))
      throw std::runtime_error(method + ": " + message["error"].dump());
    return message.at("result");
  }
}

Json Browser::read_message() {
  while (true) {
    const std::size_t end = buffer_.find('\0');
    if (end != std::string::npos) {
      Json message = Json::parse(buffer_.substr(0, end));
      buffer_.erase(0, end + 1);
      return message;
    }
    pollfd readable{.fd = from_browser_, .events = POLLIN, .revents = 0};
    if (poll(&readable, 1, answer_timeout_ms) <= 0)
      throw std::runtime_error("the browser does not answer");
    std::array<char, 65536> chunk{};
    const ssize_t count = read(from_browser_, chunk.data(), chunk.size());
    if (count <= 0) throw std::runtime_error("the browser has gone");
    buffer_.append(chunk.data(), static_cast<std::size_t>(count));
  }
}

void Browser::take_note(const Json& message) {
  const std::string method = message.value("method", "");
  const Json parameters = message.value("params", Json::object());
  if (method == "Page.loadEventFired") loaded_ = true;
  const bool console_error =
      method == "Runtime.consoleAPICalled" && parameters.value("type", "") == "error";
  const bool log_error =
      method == "Log.entryAdded" && parameters["entry"].value("level", "") == "error";
  if (method == "Runtime.exceptionThrown" || console_error || log_error)
    errors_.push_back(parameters.dump());
}

}  // namespace sinerig::test
