#include "gateway/machine_names.h"

#include <arpa/inet.h>
#include <fmt/format.h>
#include <ifaddrs.h>
#include <net/if.h>
#include <netdb.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <memory>
#include <stdexcept>

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

// Asks the kernel from which address a packet to this one would go; no packet is sent. Empty if
// there is no route.
std::string AddressOfRouteTo(const sockaddr& other, socklen_t size) {
  const int fd = socket(other.sa_family, SOCK_DGRAM | SOCK_CLOEXEC, 0);
  sockaddr_storage own{};
  socklen_t own_size = sizeof(own);
  const bool known = fd >= 0 && connect(fd, &other, size) == 0 &&
                     getsockname(fd, reinterpret_cast<sockaddr*>(&own), &own_size) == 0;
  if (fd >= 0) {
    close(fd);
  }
  return known ? TextOf(reinterpret_cast<sockaddr&>(own), own_size) : "";
}

// To addresses that are for documentation only (RFC 5737, RFC 3849).
std::string AddressOfRouteOut() {
  sockaddr_in v4{};
  v4.sin_family = AF_INET;
  v4.sin_port = htons(9);
  inet_pton(AF_INET, "192.0.2.1", &v4.sin_addr);
  if (std::string own = AddressOfRouteTo(reinterpret_cast<sockaddr&>(v4), sizeof(v4));
      !own.empty()) {
    return own;
  }
  sockaddr_in6 v6{};
  v6.sin6_family = AF_INET6;
  v6.sin6_port = htons(9);
  inet_pton(AF_INET6, "2001:db8::1", &v6.sin6_addr);
  return AddressOfRouteTo(reinterpret_cast<sockaddr&>(v6), sizeof(v6));
}

// A link-local IPv6 address is of no use: browsers do not take its interface.
bool IsForOthers(const std::string& address) {
  return !address.starts_with("127.") && address != "::1" && !address.starts_with("fe80:");
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
  if (!is_address && !std::ranges::all_of(host, [](unsigned char c) {
        return std::isalnum(c) != 0 || c == '.' || c == '-' || c == '_';
      })) {
    throw std::runtime_error(
        fmt::format("--host {}: give a name or an address alone, as hall.example.org", host));
  }
  (is_address ? names->addresses : names->hosts).push_back(host);
}

std::string AddressForOthers(const MachineNames& names) {
  std::string address = AddressOfRouteOut();
  return address.empty() ? ReachableOf(names) : address;
}

std::string ReachableOf(const MachineNames& names) {
  const auto is_v6 = [](const std::string& address) {
    return address.find(':') != std::string::npos;
  };
  for (const bool v6 : {false, true}) {
    for (const std::string& address : names.addresses) {
      if (is_v6(address) == v6 && IsForOthers(address)) {
        return address;
      }
    }
  }
  return "127.0.0.1";
}

std::string AnyAddress() {
  const int fd = socket(AF_INET6, SOCK_STREAM | SOCK_CLOEXEC, 0);
  if (fd < 0) {
    return "0.0.0.0";
  }
  close(fd);
  return "::";
}

}  // namespace pangea
