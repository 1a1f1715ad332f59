#include "bus/transport.hpp"

#include "bus/hub.hpp"
#include "bus/socketcan.hpp"

namespace vcnc {

std::unique_ptr<Transport> open_transport(const std::string& uri, int node_id) {
  const std::size_t separator = uri.find("://");
  const std::string scheme = uri.substr(0, separator);
  const std::string rest = separator == std::string::npos ? "" : uri.substr(separator + 3);
  if (scheme == "hub" && rest.starts_with('/'))
    return std::make_unique<HubTransport>(rest, node_id);
  if (scheme == "can" && !rest.empty()) return std::make_unique<SocketcanTransport>(rest);
  throw BusError("bus \"" + uri + "\": allowed are hub:///path/of/socket and can://interface");
}

}  // namespace vcnc
