// The program itself, started as a user would.
#pragma once

#include <csignal>
#include <fcntl.h>
#include <filesystem>
#include <fstream>
#include <iterator>
#include <string>
#include <unistd.h>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>

namespace sinerig::test {

struct Finished {
  int code = -1;  // exit code; −signal when it was killed
  std::string out;
  std::string err;
};

// A process with a pipe on its standard output; standard error goes to a file.
class Program {
 public:
  enum class Stdin { null, closed };

  Program(std::vector<std::string> arguments, const std::filesystem::path& folder,
          Stdin input = Stdin::null)
      : err_{folder / "stderr.txt"} {
    arguments.insert(arguments.begin(), SINERIG_BINARY);
    std::vector<char*> argv;
    for (std::string& each : arguments) argv.push_back(each.data());
    argv.push_back(nullptr);
    int pipe_ends[2] = {};
    EXPECT_EQ(pipe(pipe_ends), 0);
    out_ = pipe_ends[0];
    pid_ = fork();
    if (pid_ != 0) {
      close(pipe_ends[1]);
      return;
    }
    // Whoever runs the tests: nohup and a script's background ignore some.
    for (const int each : {SIGINT, SIGQUIT, SIGHUP, SIGPIPE}) std::signal(each, SIG_DFL);
    const int null = open("/dev/null", O_RDONLY);
    const int err = open(err_.c_str(), O_WRONLY | O_CREAT | O_TRUNC, 0600);
    if (input == Stdin::null) {
      dup2(null, STDIN_FILENO);
    } else {
      close(STDIN_FILENO);
    }
    dup2(pipe_ends[1], STDOUT_FILENO);
    dup2(err, STDERR_FILENO);
    close(pipe_ends[0]);
    if (chdir(folder.c_str()) == 0) execv(SINERIG_BINARY, argv.data());
    _exit(127);
  }
  ~Program() {
    close_output();
    if (pid_ > 0) {
      kill(pid_, SIGKILL);
      waitpid(pid_, nullptr, 0);
    }
  }
  Program(const Program&) = delete;
  Program& operator=(const Program&) = delete;

  // Waits for the next line of output; empty at its end.
  std::string read_line() {
    std::string line;
    char letter = 0;
    while (read(out_, &letter, 1) == 1) {
      line += letter;
      if (letter == '\n') break;
    }
    return line;
  }
  void send(int signal) const { kill(pid_, signal); }
  pid_t pid() const { return pid_; }
  void close_output() {
    if (out_ >= 0) close(out_);
    out_ = -1;
  }

  Finished finish() {
    Finished finished;
    if (out_ >= 0) {
      for (std::string line = read_line(); !line.empty(); line = read_line()) finished.out += line;
    }
    int status = 0;
    waitpid(pid_, &status, 0);
    pid_ = -1;
    finished.code = WIFEXITED(status) ? WEXITSTATUS(status) : -WTERMSIG(status);
    std::ifstream err{err_};
    finished.err.assign(std::istreambuf_iterator<char>{err}, {});
    return finished;
  }

 private:
  std::filesystem::path err_;
  pid_t pid_ = -1;
  int out_ = -1;
};

// A folder of its own for each test, and the program run in it.
class ProgramTest : public testing::Test {
 protected:
  ProgramTest() {
    std::filesystem::remove_all(folder_);
    std::filesystem::create_directories(folder_);
  }
  ~ProgramTest() override { std::filesystem::remove_all(folder_); }

  Finished run(std::vector<std::string> arguments) {
    return Program{std::move(arguments), folder_}.finish();
  }
  std::string path(const std::string& name) const { return folder_ / name; }
  void write(const std::string& name, const std::string& text) const {
    std::ofstream{path(name)} << text;
  }
  std::string read(const std::string& name) const {
    std::ifstream stream{path(name)};
    return {std::istreambuf_iterator<char>{stream}, {}};
  }

  std::filesystem::path folder_ = [] {
    std::string name = testing::UnitTest::GetInstance()->current_test_info()->test_suite_name();
    name += testing::UnitTest::GetInstance()->current_test_info()->name();
    for (char& letter : name) letter = letter == '/' ? '-' : letter;
    return std::filesystem::path{testing::TempDir()} / name;
  }();
};

}  // namespace sinerig::test
