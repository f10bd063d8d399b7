#include "gateway/machine_names.h"

#include <arpa/inet.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <memory>

namespace pangea {
namespace {

std::string TextOf(const sockaddr& address, socklen_t size) {
  std::array<char, NI_MAXHOST> text{};
  if (getnameinfo(&address, size, text.data(), text.size(), nullptr, 0, NI_NUMERICHOST) != 0) {
    return "";
  }
  const std::string host = text.data();
  return host.substr(0, host.find('%'));  // "fe80::1%eth0" without the interface
}

std::vector<std::string> AddressesOfInterfaces() {
  ifaddrs* first = nullptr;
  if (getifaddrs(&first) != 0) {
    return {"127.0.0.1", "::1"};
  }
  const std::unique_ptr<ifaddrs, decltype(&freeifaddrs)> owner(first, freeifaddrs);
  std::vector<std::string> addresses;
  for (const ifaddrs* at = first; at != nullptr; at = at->ifa_next) {
    if (at->ifa_addr == nullptr || (at->ifa_flags & IFF_UP) == 0) {
      continue;
    }
    if (at->ifa_addr->sa_family == AF_INET) {
      addresses.push_back(TextOf(*at->ifa_addr, sizeof(sockaddr_in)));
    } else if (at->ifa_addr->sa_family == AF_INET6) {
      addresses.push_back(TextOf(*at->ifa_addr, sizeof(sockaddr_in6)));
    }
  }
  std::erase(addresses, "");
  return addresses;
}

// Asks the kernel from which address a packet to other networks would go; no packet is sent.
std::string AddressOfRouteOut() {
  const int fd = socket(AF_INET, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_in other{};
  other.sin_family = AF_INET;
  other.sin_port = htons(9);
  inet_pton(AF_INET, "192.0.2.1", &other.sin_addr);  // for documentation only (RFC 5737)
  sockaddr_in own{};
  socklen_t size = sizeof(own);
  const bool known = fd >= 0 &&
                     connect(fd, reinterpret_cast<sockaddr*>(&other), sizeof(other)) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&own), &size) == 0;
  if (fd >= 0) {
    close(fd);
  }
  return known ? TextOf(reinterpret_cast<sockaddr&>(own), sizeof(own)) : "";
}

}  // namespace

MachineNames NamesOfThisMachine() {
  MachineNames names{{"localhost"}, AddressesOfInterfaces()};
  std::array<char, 256> host{};
  if (gethostname(host.data(), host.size() - 1) == 0 && host[0] != '\0') {
    const std::string name = host.data();
    names.hosts.push_back(name);
    names.hosts.push_back(name.substr(0, name.find('.')) + ".local");
  }
  return names;
}

void AddTo(MachineNames* names, const std::string& host) {
  std::array<unsigned char, sizeof(in6_addr)> bytes{};
  const bool is_address = inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
                          inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
  (is_address ? names->addresses : names->hosts).push_back(host);
}

std::string AddressForOthers(const MachineNames& names) {
  if (std::string address = AddressOfRouteOut(); !address.empty()) {
    return address;
  }
  const auto found = std::ranges::find_if(names.addresses, [](const std::string& address) {
    return address.find(':') == std::string::npos && !address.starts_with("127.");
  });
  return found == names.addresses.end() ? "127.0.0.1" : *found;
}

}  // namespace pangea
