// Datagrams on the truth channel, {length, bytes} each: what is collected is what was sent.
#include <sys/socket.h>
#include <sys/un.h>

#include <cstring>

#include "bus/fd.hpp"
#include "bus/truth.hpp"
#include "fuzz.hpp"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace vcnc;
  const std::string path = "/tmp/vcnc_fuzz_truth_" + std::to_string(getpid());
  static const std::unique_ptr<TruthPort> reader = open_truth_reader(path);
  sockaddr_un address{};
  address.sun_family = AF_UNIX;
  std::memcpy(address.sun_path, path.data(), path.size());
  static const Fd socket(::socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC, 0));
  fuzz::Bytes bytes(data, size);
  std::array<TruthCycle, kTruthAxes> cycles{};
  while (!bytes.empty()) {
    const auto said = bytes.take(bytes.byte());
    ::sendto(socket.get(), said.data(), said.size(), MSG_DONTWAIT | MSG_NOSIGNAL,
             reinterpret_cast<const sockaddr*>(&address), sizeof address);
    for (const Tick k : {Tick{0}, Tick{1}, Tick{-1}})
      if (reader->collect(k, cycles))
        for (const TruthCycle& cycle : cycles) fuzz::require(cycle.tick == k);
  }
  return 0;
}
