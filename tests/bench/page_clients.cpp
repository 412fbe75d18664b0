#include "bench/page_clients.h"

#include <array>
#include <cerrno>
#include <csignal>
#include <cstdlib>
#include <cstring>
#include <netinet/in.h>
#include <poll.h>
#include <stdexcept>
#include <string>
#include <unistd.h>
#include <vector>

#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <sys/wait.h>

namespace sinerig::bench {

namespace {

constexpr const char* mark = "--as-clients";
constexpr const char* stream_request = "GET /events?since=0 HTTP/1.1\r\nHost: localhost\r\n\r\n";

int connected(std::uint16_t port, int window) {
  const int socket = ::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (socket < 0) return -1;
  if (window > 0) setsockopt(socket, SOL_SOCKET, SO_RCVBUF, &window, sizeof window);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_port = htons(port);
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  if (connect(socket, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0) return socket;
  close(socket);
  return -1;
}

void send_text(int socket, const std::string& text) {
  ::send(socket, text.data(), text.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
}

[[noreturn]] void watch(const std::vector<int>& sockets) {
  std::vector<pollfd> readable;
  readable.reserve(sockets.size());
  for (const int socket : sockets)
    readable.push_back({.fd = socket, .events = POLLIN, .revents = 0});
  std::vector<char> bytes(1U << 16U);
  while (poll(readable.data(), readable.size(), -1) >= 0) {
    for (pollfd& each : readable) {
      if (each.revents == 0) continue;
      if (recv(each.fd, bytes.data(), bytes.size(), MSG_DONTWAIT) == 0) each.fd = -1;
    }
  }
  std::_Exit(1);
}

// A thousand times a second one client goes and another comes.
[[noreturn]] void misbehave(std::vector<int> sockets, std::uint16_t port) {
  const std::array<std::string, 5> words{"\x16\x03\x01\x02nonsense\r\n\r\n", "GET /eve",
                                         "POST /stop HTTP/1.1\r\nHost: localhost\r\n\r\n",
                                         stream_request, std::string(9000, 'x')};
  for (std::size_t i = 0;; ++i) {
    int& socket = sockets[i % sockets.size()];
    if (socket >= 0) close(socket);
    socket = connected(port, 0);
    if (socket >= 0) send_text(socket, words[i % words.size()]);
    usleep(1000);
  }
}

}  // namespace

PageClients::PageClients(ClientKind kind, int count, std::uint16_t port) {
  if (kind == ClientKind::none) return;
  std::array<int, 2> ends{};
  if (pipe(ends.data()) != 0) throw std::runtime_error("no pipe for the clients");
  std::array<std::string, 6> words{"bench_dashboard",
                                   mark,
                                   std::to_string(static_cast<int>(kind)),
                                   std::to_string(count),
                                   std::to_string(port),
                                   std::to_string(ends[1])};
  std::array<char*, 7> arguments{};
  for (std::size_t i = 0; i < words.size(); ++i) arguments[i] = words[i].data();
  child_ = fork();
  if (child_ == 0) {
    prctl(PR_SET_PDEATHSIG, SIGKILL);
    execv("/proc/self/exe", arguments.data());
    _exit(127);
  }
  close(ends[1]);
  char ready = 0;
  const bool told = read(ends[0], &ready, 1) == 1;
  close(ends[0]);
  if (!told) throw std::runtime_error("the clients could not connect");
}

PageClients::~PageClients() {
  if (child_ <= 0) return;
  kill(child_, SIGKILL);
  waitpid(child_, nullptr, 0);
}

void PageClients::require() const {
  if (child_ > 0 && waitpid(child_, nullptr, WNOHANG) == child_)
    throw std::runtime_error("the clients have ended by themselves");
}

std::optional<int> act_as_clients(int count, char** arguments) {
  if (count != 6 || std::strcmp(arguments[1], mark) != 0) return std::nullopt;
  const auto kind = static_cast<ClientKind>(std::atoi(arguments[2]));
  const int clients = std::atoi(arguments[3]);
  const auto port = static_cast<std::uint16_t>(std::atoi(arguments[4]));
  const int told = std::atoi(arguments[5]);
  std::vector<int> sockets;
  for (int i = 0; i < clients; ++i) {
    const int socket = connected(port, kind == ClientKind::stall ? 2048 : 0);
    if (socket < 0) return 1;
    if (kind != ClientKind::misbehave) send_text(socket, stream_request);
    sockets.push_back(socket);
  }
  if (write(told, "1", 1) != 1) return 1;
  close(told);
  if (kind == ClientKind::watch) watch(sockets);
  if (kind == ClientKind::misbehave) misbehave(std::move(sockets), port);
  while (true) pause();
}

}  // namespace sinerig::bench
