#include "dashboard/listener.h"

#include <arpa/inet.h>
#include <cerrno>
#include <cstring>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <stdexcept>
#include <unistd.h>

#include <sys/socket.h>

namespace sinerig::dashboard {

namespace {

socklen_t fill(const Address& address, sockaddr_storage& storage) {
  if (address.ipv6()) {
    auto& six = reinterpret_cast<sockaddr_in6&>(storage);
    six.sin6_family = AF_INET6;
    six.sin6_port = htons(address.port);
    inet_pton(AF_INET6, address.host.c_str(), &six.sin6_addr);
    return sizeof six;
  }
  auto& four = reinterpret_cast<sockaddr_in&>(storage);
  four.sin_family = AF_INET;
  four.sin_port = htons(address.port);
  inet_pton(AF_INET, address.host.c_str(), &four.sin_addr);
  return sizeof four;
}

[[noreturn]] void fail(const Address& address, int error) {
  std::string what = "--serve " + address.text() + ": " + std::strerror(error);
  if (error == EADDRINUSE) what += "; give another port, or :0 for any free one";
  throw std::runtime_error{what};
}

}  // namespace

Listener::Listener(const Address& address) {
  sockaddr_storage storage{};
  const socklen_t size = fill(address, storage);
  socket_ = ::socket(storage.ss_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (socket_ < 0) fail(address, errno);
  const int on = 1;
  setsockopt(socket_, SOL_SOCKET, SO_REUSEADDR, &on, sizeof on);
  auto* plain = reinterpret_cast<sockaddr*>(&storage);
  socklen_t length = sizeof storage;
  if (bind(socket_, plain, size) != 0 || listen(socket_, 128) != 0 ||
      getsockname(socket_, plain, &length) != 0) {
    const int error = errno;
    close(socket_);
    fail(address, error);
  }
  port_ = ntohs(address.ipv6() ? reinterpret_cast<sockaddr_in6&>(storage).sin6_port
                               : reinterpret_cast<sockaddr_in&>(storage).sin_port);
}

Listener::~Listener() {
  close(socket_);
}

int Listener::accept() {
  const int client = accept4(socket_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
  if (client < 0) {
    exhausted_ = errno == EMFILE || errno == ENFILE || errno == ENOBUFS || errno == ENOMEM;
    return -1;
  }
  const int on = 1;
  setsockopt(client, IPPROTO_TCP, TCP_NODELAY, &on, sizeof on);
  return client;
}

}  // namespace sinerig::dashboard
