#pragma once

// The gateway's certificates and address, in the site's folder:
//
//   gateway/ca.pem, ca.key           its authority, made at the first start; ca.key has mode 0600
//   gateway/server.pem, server.key   its certificate; made again at a start if it expires within 30
//                                    days, or if the machine has another name or address
//   gateway/address.json             its last address: "url", and the authority's "fingerprint"

#include <string>
#include <vector>

#include "gateway/certificates.h"
#include "site/site.h"

namespace pangea {

struct GatewayIdentity {
  Identity server;
  std::string authority_pem;          // empty: the certificate is the user's own
  std::vector<std::string> left_out;  // names that the authority may not sign
};

// Reads the certificates and makes those that are missing. Throws std::runtime_error with the file
// and advice.
GatewayIdentity OpenIdentity(const site::Site& site, const MachineNames& names, int64_t now_s);
// Reads the user's own certificate and key from PEM files. Throws std::runtime_error.
GatewayIdentity ReadIdentity(const std::string& certificate_file, const std::string& key_file);

struct GatewayAddress {
  std::string url;          // "https://192.168.1.7:8443/"
  std::string fingerprint;  // of the authority, or of the user's certificate
};
void WriteAddress(const site::Site& site, const GatewayAddress& address);
// Throws std::runtime_error if the gateway never ran on this site.
GatewayAddress ReadAddress(const site::Site& site);

}  // namespace pangea
