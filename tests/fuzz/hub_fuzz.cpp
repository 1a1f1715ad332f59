// Datagrams at the hub: clients that say anything, {client, length, bytes}; length FFh hangs up.
// Afterwards the hub still serves.
#include <sys/socket.h>

#include <array>
#include <chrono>
#include <thread>

#include "bus/fd.hpp"
#include "bus/hub.hpp"
#include "bus/hub_socket.hpp"
#include "bus/messages.hpp"
#include "bus/slot_codec.hpp"
#include "fuzz.hpp"

namespace {

using namespace vcnc;

std::string hub_path() { return "/tmp/vcnc_fuzz_hub_" + std::to_string(getpid()); }

Fd open_client() {
  Fd fd(::socket(AF_UNIX, SOCK_SEQPACKET | SOCK_CLOEXEC, 0));
  fuzz::require(fd.valid() && connect_to(fd.get(), hub_address(hub_path())) == 0);
  return fd;
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  static Hub hub(hub_path());
  fuzz::Bytes bytes(data, size);
  std::array<Fd, 4> clients;
  for (int n = 0; !bytes.empty() && n < 64; ++n) {
    Fd& client = clients[bytes.byte() % clients.size()];
    const std::size_t length = bytes.byte();
    if (length == 0xff) {
      client = Fd();
      continue;
    }
    if (!client.valid()) client = open_client();
    const auto said = bytes.take(length);
    ::send(client.get(), said.data(), said.size(), MSG_DONTWAIT | MSG_NOSIGNAL);
  }
  for (Fd& client : clients) client = Fd();
  // A node and a master of good manners still reach each other; ids may be in use for a moment.
  for (int tries = 0;; ++tries) {
    try {
      HubTransport master(hub.uri().substr(6), 0), node(hub.uri().substr(6), 5);
      const Frame frame = encode(Heartbeat{5, NmtState::boot_up});
      node.send({&frame, 1});
      Frames heard;
      while (master.receive(heard, 2000) == Transport::Received::frames)
        if (std::find(heard.begin(), heard.end(), frame) != heard.end()) return 0;
    } catch (const BusError&) {
    }
    fuzz::require(tries < 20);
    std::this_thread::sleep_for(std::chrono::milliseconds(20));
  }
}
