// A headless Chromium driven through the DevTools protocol over a pair of pipes.
#pragma once

#include <chrono>
#include <optional>
#include <string>
#include <vector>

#include <nlohmann/json.hpp>
#include <sys/types.h>

namespace sinerig::test {

class Browser {
 public:
  // The program to start, or nothing where this machine has none.
  static std::optional<std::string> find();

  // Starts `program` with a fresh profile and an empty page. Throws std::runtime_error when it does
  // not answer.
  explicit Browser(const std::string& program);
  ~Browser();
  Browser(const Browser&) = delete;
  Browser& operator=(const Browser&) = delete;

  // Opens a page in a window of this size and waits until it has loaded.
  void open(const std::string& url, int width, int height);
  void prefer_dark(bool dark);

  // The value of a JavaScript expression in the page. Throws std::runtime_error when it throws.
  nlohmann::json evaluate(const std::string& expression);

  // Returns as soon as the expression is true in the page, false after half a minute. The page may
  // load itself again meanwhile.
  bool wait_until(const std::string& expression);

  void move_mouse(double x, double y);
  void click(double x, double y);
  void double_click(double x, double y);
  void drag(double from_x, double from_y, double to_x, double to_y);
  void press_key(const std::string& key);

  // The visible part of the page as PNG bytes.
  std::string screenshot();

  // Errors that the page has reported since it was opened: exceptions, console errors, failed
  // loads.
  const std::vector<std::string>& errors() const { return errors_; }

 private:
  nlohmann::json call(const std::string& method, const nlohmann::json& parameters);
  void mouse(const char* type, double x, double y, int buttons, int clicks);
  nlohmann::json read_message();
  void take_note(const nlohmann::json& message);

  pid_t process_ = -1;
  int to_browser_ = -1;
  int from_browser_ = -1;
  std::string profile_;
  std::string buffer_;
  std::string session_;
  int next_id_ = 1;
  bool loaded_ = false;
  std::vector<std::string> errors_;
};

}  // namespace sinerig::test
