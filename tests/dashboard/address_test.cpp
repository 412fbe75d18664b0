#include "dashboard/address.h"

#include <stdexcept>

#include <gmock/gmock.h>

namespace sinerig::dashboard {
namespace {

TEST(Address, IsLoopbackUnlessAsked) {
  for (const char* text :
       {"", "9000", ":9000", "localhost", "localhost:9000", "127.0.0.1", "[::1]:1"})
    EXPECT_TRUE(parse_address(text).loopback()) << text;
  EXPECT_EQ(parse_address("").text(), "127.0.0.1:8077");
  EXPECT_FALSE(parse_address("0.0.0.0").loopback());
  EXPECT_FALSE(parse_address("[::]:80").loopback());
}

TEST(Address, TakesBothParts) {
  EXPECT_EQ(parse_address("192.168.1.5:9000").text(), "192.168.1.5:9000");
  EXPECT_EQ(parse_address("192.168.1.5").text(), "192.168.1.5:8077");
  EXPECT_EQ(parse_address(":0").text(), "127.0.0.1:0");
  EXPECT_EQ(parse_address("[fe80::1]:12").text(), "[fe80::1]:12");
  EXPECT_EQ(parse_address("::1").text(), "[::1]:8077");
}

TEST(Address, RefusesWithWhatWasMeant) {
  for (const char* text : {"65536", "gimbal.local:80", "127.0.0.1:", "127.0.0.1:x", "[::1",
                           "[::1]9", "1.2.3", "-1", "127.0.0.1:+80"}) {
    try {
      const Address taken = parse_address(text);
      ADD_FAILURE() << text << " taken as " << taken.text();
    } catch (const std::invalid_argument& error) {
      EXPECT_THAT(error.what(), testing::HasSubstr("give ADDR:PORT")) << text;
    }
  }
}

TEST(Address, KnowsTheNamesOfThisMachine) {
  for (const char* ours : {"localhost", "127.0.0.1", "127.1.2.3", "[::1]"})
    EXPECT_TRUE(is_this_machine(ours)) << ours;
  for (const char* other : {"127.evil.example", "127.0.0.1.evil.example", "localhost.evil.example",
                            "128.0.0.1", "127.", "127.1", "::2", ""})
    EXPECT_FALSE(is_this_machine(other)) << other;
}

}  // namespace
}  // namespace sinerig::dashboard
