// A name may take seconds to be looked up, where its server is gone with the connection: that is
// done once. This program counts the look-ups, its own and libmodbus's, by answering them itself.
#include <arpa/inet.h>
#include <dlfcn.h>
#include <netdb.h>
#include <netinet/in.h>
#include <string>
#include <unistd.h>

#include <gmock/gmock.h>
#include <sys/socket.h>

#include "drivers/modbus/transport.h"

namespace {
int names_looked_up = 0;
}  // namespace

// In place of the C library's.
extern "C" int getaddrinfo(const char* node, const char* service, const addrinfo* hints,
                           addrinfo** found) {
  using Function = int (*)(const char*, const char*, const addrinfo*, addrinfo**);
  static const auto real = reinterpret_cast<Function>(dlsym(RTLD_NEXT, "getaddrinfo"));
  const bool is_name = std::string{node} == "the-drive";
  if (is_name) ++names_looked_up;
  return real(is_name ? "127.0.0.1" : node, service, hints, found);
}

namespace sinerig::modbus {
namespace {

TEST(ModbusHost, IsLookedUpOnceHoweverOftenItIsConnectedTo) {
  const int listener = socket(AF_INET, SOCK_STREAM, 0);
  sockaddr_in address{};
  address.sin_family = AF_INET;
  address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
  socklen_t size = sizeof address;
  ASSERT_EQ(bind(listener, reinterpret_cast<const sockaddr*>(&address), size), 0);
  ASSERT_EQ(listen(listener, 8), 0);
  getsockname(listener, reinterpret_cast<sockaddr*>(&address), &size);

  ConnectionSettings settings;
  settings.host = "the-drive";
  settings.port = ntohs(address.sin_port);
  Transport transport{settings};
  transport.connect();
  for (int n = 0; n < 3; ++n) EXPECT_TRUE(transport.try_connect());
  EXPECT_EQ(names_looked_up, 1);
  close(listener);
}

TEST(ModbusHost, ThatNobodyKnowsIsSaid) {
  ConnectionSettings settings;
  settings.name = "drive";
  settings.host = "no-such-host.invalid";
  Transport transport{settings};
  EXPECT_THAT([&] { transport.connect(); },
              testing::ThrowsMessage<std::runtime_error>(testing::HasSubstr(
                  "[modbus.drive] no-such-host.invalid:502: nobody knows this host")));
}

}  // namespace
}  // namespace sinerig::modbus
