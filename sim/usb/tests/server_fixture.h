// What the server's test works with: a device made of descriptors only, and a client's socket.
#pragma once

#include "cmocka_cpp.h"

#include <cerrno>
#include <cstring>

#include <arpa/inet.h>
#include <poll.h>
#include <sys/socket.h>
#include <unistd.h>

#include "device_port.h"

namespace bridge_sim
{

constexpr int PATIENCE_MS = 20000;

// As the bridge has them: vendor interface 0 with bulk IN 0x81, HID interface 1 with interrupt IN 0x82.
inline Descriptors test_descriptors()
{
    return {{18, 1, 0x00, 0x02, 0, 0, 0, 64, 0x09, 0x12, 0x01, 0x00, 0x02, 0x00, 1, 2, 3, 1},
            {9, 2,    41,   0, 2, 1, 0, 0x80, 250, 9,    4, 0, 0, 1, 0xFF, 0,    0, 0,  7, 5, 0x81,
             2, 0x00, 0x02, 0, 9, 4, 1, 0,    1,   0x03, 0, 0, 0, 7, 5,    0x82, 3, 64, 0, 8}};
}

// A client's end; it waits for what the server sends, and lets the server work meanwhile.
class TestClient
{
  public:
    TestClient(DevicePort &server, uint16_t port) : server_(server), socket_(socket(AF_INET, SOCK_STREAM, 0))
    {
        sockaddr_in address{};
        address.sin_family = AF_INET;
        address.sin_port = htons(port);
        address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
        assert_int_equal(connect(socket_, reinterpret_cast<sockaddr *>(&address), sizeof address), 0);
    }

    ~TestClient()
    {
        close(socket_);
    }

    int descriptor() const
    {
        return socket_;
    }

    void send(const Bytes &bytes)
    {
        assert_int_equal(::send(socket_, bytes.data(), bytes.size(), MSG_NOSIGNAL), bytes.size());
    }

    // Exactly so many bytes of the server.
    Bytes receive(size_t count)
    {
        Bytes bytes(count);
        for (size_t at = 0; at < count;) {
            work();
            const ssize_t got = recv(socket_, bytes.data() + at, count - at, MSG_DONTWAIT);
            assert_int_not_equal(got, 0);
            at += got > 0 ? static_cast<size_t>(got) : 0;
        }
        return bytes;
    }

    // Until the server has closed the connection.
    void expect_end()
    {
        uint8_t byte;
        ssize_t got = -1;
        while (got < 0) {
            work();
            got = recv(socket_, &byte, 1, MSG_DONTWAIT);
            assert_true(got <= 0);
            got = got < 0 && errno == ECONNRESET ? 0 : got;
        }
    }

    // The next request of this client that reaches the model.
    DeviceRequest await_request()
    {
        take();
        while (requests_.empty()) {
            work();
        }
        DeviceRequest first = requests_.front();
        requests_.erase(requests_.begin());
        return first;
    }

    // Lets the server take what has come; waits for something to come, there or here.
    void work()
    {
        pollfd wait[] = {{server_.wake_descriptor(), POLLIN, 0}, {socket_, POLLIN, 0}};
        assert_true(poll(wait, 2, PATIENCE_MS) > 0);
        take();
    }

  private:
    void take()
    {
        for (DeviceRequest &request : server_.take_requests()) {
            requests_.push_back(std::move(request));
        }
    }

    DevicePort &server_;
    int socket_;
    std::vector<DeviceRequest> requests_;
};

// The model's answer to a request.
inline void complete(DevicePort &server, DeviceRequest request, int status, const Bytes &data = {})
{
    request.urb.status = status;
    if (request.urb.kind != UrbKind::CONTROL || request.urb.setup.to_host()) {
        request.urb.data = data;
    }
    server.deliver({request.urb});
}

} // namespace bridge_sim
