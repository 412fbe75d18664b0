#include <algorithm>
#include <arpa/inet.h>
#include <cerrno>
#include <map>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <unistd.h>

#include <sys/socket.h>
#include <system_error>

#include "sim/modbus_drive/line.h"

namespace sinerig::sim {
namespace {

constexpr std::size_t header_bytes = 6;  // number, protocol, length
constexpr std::size_t longest = 260;

void require(bool condition, const char* what) {
  if (!condition) throw std::system_error(errno, std::generic_category(), what);
}

class TcpLine final : public Line {
 public:
  explicit TcpLine(const DriveSettings& settings) : host_{settings.host}, port_{settings.port} {
    listen_again();
  }
  ~TcpLine() override {
    drop();
    if (listener_ >= 0) close(listener_);
  }

  std::string address() const override { return host_ + ":" + std::to_string(port_); }

  std::vector<pollfd> inputs() const override {
    std::vector<pollfd> inputs;
    if (listener_ >= 0) inputs.push_back({.fd = listener_, .events = POLLIN, .revents = 0});
    for (const auto& [id, client] : clients_)
      inputs.push_back({.fd = client.fd, .events = POLLIN, .revents = 0});
    return inputs;
  }

  std::vector<Frame> receive() override {
    accept_all();
    std::vector<Frame> frames;
    for (auto client = clients_.begin(); client != clients_.end();) {
      const bool alive = read_all(client->second);
      take_frames(client->first, client->second.input, frames);
      if (!alive) close(client->second.fd);
      client = alive ? std::next(client) : clients_.erase(client);
    }
    return frames;
  }

  void send(const Frame& reply, bool spoiled) override {
    const auto client = clients_.find(reply.from);
    if (client == clients_.end()) return;
    const std::size_t length = 1 + reply.pdu.size();
    Bytes bytes{static_cast<std::uint8_t>(reply.number / 256),
                static_cast<std::uint8_t>(reply.number % 256),
                0,
                0,
                static_cast<std::uint8_t>(length / 256),
                static_cast<std::uint8_t>(length % 256),
                reply.unit};
    bytes.insert(bytes.end(), reply.pdu.begin(), reply.pdu.end());
    // A function code and a byte count that fit no request.
    if (spoiled) std::fill(bytes.begin() + header_bytes + 1, bytes.end(), std::uint8_t{0});
    [[maybe_unused]] const ssize_t sent =
        ::send(client->second.fd, bytes.data(), bytes.size(), MSG_NOSIGNAL | MSG_DONTWAIT);
  }

  void drop() override {
    for (const auto& [id, client] : clients_) close(client.fd);
    clients_.clear();
  }

  void set_open(bool open) override {
    if (open && listener_ < 0) listen_again();
    if (!open && listener_ >= 0) {
      close(listener_);
      listener_ = -1;
    }
  }

  std::int64_t wire_ns(const Frame& /*frame*/) const override { return 0; }

 private:
  struct Client {
    int fd = -1;
    Bytes input;
  };

  void listen_again() {
    listener_ = socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
    require(listener_ >= 0, "socket");
    const int yes = 1;
    setsockopt(listener_, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<std::uint16_t>(port_));
    errno = EINVAL;
    require(inet_pton(AF_INET, host_.c_str(), &address.sin_addr) == 1, host_.c_str());
    socklen_t size = sizeof address;
    require(bind(listener_, reinterpret_cast<const sockaddr*>(&address), size) == 0, "bind");
    require(listen(listener_, 4) == 0, "listen");
    require(getsockname(listener_, reinterpret_cast<sockaddr*>(&address), &size) == 0,
            "getsockname");
    port_ = ntohs(address.sin_port);
  }

  void accept_all() {
    while (listener_ >= 0) {
      const int fd = accept4(listener_, nullptr, nullptr, SOCK_CLOEXEC | SOCK_NONBLOCK);
      if (fd < 0) return;
      const int yes = 1;
      setsockopt(fd, IPPROTO_TCP, TCP_NODELAY, &yes, sizeof yes);
      clients_[++last_id_] = {.fd = fd, .input = {}};
    }
  }

  static bool read_all(Client& client) {
    std::uint8_t buffer[512];
    while (true) {
      const ssize_t count = read(client.fd, buffer, sizeof buffer);
      if (count > 0) client.input.insert(client.input.end(), buffer, buffer + count);
      if (count == 0) return false;
      if (count < 0) return errno == EAGAIN || errno == EINTR;
    }
  }

  static void take_frames(std::uint64_t id, Bytes& input, std::vector<Frame>& frames) {
    while (input.size() >= header_bytes) {
      const std::size_t length = input[4] * std::size_t{256} + input[5];
      const bool nonsense = length < 2 || length > longest;
      if (nonsense) input.clear();
      if (nonsense || input.size() < header_bytes + length) return;
      const auto end = input.begin() + static_cast<std::ptrdiff_t>(header_bytes + length);
      frames.push_back({.from = id,
                        .number = static_cast<std::uint16_t>(input[0] * 256 + input[1]),
                        .unit = input[6],
                        .pdu = Bytes(input.begin() + header_bytes + 1, end)});
      input.erase(input.begin(), end);
    }
  }

  std::string host_;
  int port_;
  int listener_ = -1;
  std::map<std::uint64_t, Client> clients_;
  std::uint64_t last_id_ = 0;
};

}  // namespace

std::unique_ptr<Line> make_tcp_line(const DriveSettings& settings) {
  return std::make_unique<TcpLine>(settings);
}

}  // namespace sinerig::sim
