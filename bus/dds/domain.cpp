#include "bus/dds/domain.hpp"

#include <dds/dds.h>

#include "bus/dds/entity.hpp"

namespace vcnc {
namespace {

// Watermarks: a writer blocks every reader's data once this much is not acknowledged. Fragment and
// message size belong together: datagrams as large as loopback takes.
constexpr const char* kConfiguration = R"(
<CycloneDDS xmlns="https://cdds.io/config"><Domain Id="any">
  <General>
    <Interfaces><NetworkInterface name="${VCNC_DDS_IF:-lo}"/></Interfaces>
    <AllowMulticast>${VCNC_DDS_MULTICAST:-false}</AllowMulticast>
    <MaxMessageSize>${VCNC_DDS_MAXMSG:-65500B}</MaxMessageSize>
    <FragmentSize>${VCNC_DDS_FRAG:-60000B}</FragmentSize>
  </General>
  <Discovery>
    <ParticipantIndex>auto</ParticipantIndex>
    <MaxAutoParticipantIndex>60</MaxAutoParticipantIndex>
    <Peers><Peer Address="${VCNC_DDS_PEER:-127.0.0.1}"/></Peers>
    <Tag>${VCNC_DDS_TAG:-}</Tag>
  </Discovery>
  <Internal>
    <NackDelay>10ms</NackDelay>
    <SocketReceiveBufferSize min="default" max="4MiB"/>
    <Watermarks><WhcHighInit>8MB</WhcHighInit><WhcHigh>64MB</WhcHigh></Watermarks>
  </Internal>
</Domain></CycloneDDS>)";

}  // namespace

DdsDomain::DdsDomain(std::uint32_t id)
    : id_(id), handle_(dds::check(dds_create_domain(id, kConfiguration), "the domain")) {}

DdsDomain::~DdsDomain() { dds_delete(handle_); }

}  // namespace vcnc
