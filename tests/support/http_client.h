// A socket to a server on this machine: well-behaved or not, as the test wants.
#pragma once

#include <cstdint>
#include <netinet/in.h>
#include <string>
#include <unistd.h>

#include <gtest/gtest.h>
#include <sys/socket.h>

namespace sinerig::test {

class HttpClient {
 public:
  // receive_buffer: bytes, that a client that does not read fills soon; 0: the system's.
  explicit HttpClient(std::uint16_t port, int receive_buffer = 0)
      : socket_{::socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)} {
    if (receive_buffer > 0)
      setsockopt(socket_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof receive_buffer);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(port);
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(socket_, reinterpret_cast<sockaddr*>(&address), sizeof address) == 0;
  }
  ~HttpClient() { close(socket_); }
  HttpClient(const HttpClient&) = delete;
  HttpClient& operator=(const HttpClient&) = delete;

  bool connected() const { return connected_; }

  HttpClient& send(const std::string& bytes) {
    ::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL);
    return *this;
  }
  HttpClient& get(const std::string& target, const std::string& headers = "") {
    return send("GET " + target + " HTTP/1.1\r\nHost: localhost\r\n" + headers + "\r\n");
  }
  HttpClient& post(const std::string& target, const std::string& headers = "") {
    return send("POST " + target + " HTTP/1.1\r\nHost: localhost\r\nContent-Length: 0\r\n" +
                headers + "\r\n");
  }

  // Everything up to the end of the connection.
  std::string rest() {
    while (more()) {
    }
    return received_;
  }
  // Until `text` has come; what has come is kept.
  bool wait_for(const std::string& text) {
    while (received_.find(text) == std::string::npos)
      if (!more()) return false;
    return true;
  }
  // "200" of "HTTP/1.1 200 OK".
  std::string status() { return rest().size() < 12 ? "" : received_.substr(9, 3); }

 private:
  bool more() {
    char bytes[65536];
    const ssize_t count = recv(socket_, bytes, sizeof bytes, 0);
    if (count > 0) received_.append(bytes, static_cast<std::size_t>(count));
    return count > 0;
  }

  int socket_;
  bool connected_ = false;
  std::string received_;
};

}  // namespace sinerig::test
