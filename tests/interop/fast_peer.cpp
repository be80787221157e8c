// A robot on Fast DDS that answers each Twist with an Odometry made of its numbers.
#include <fastcdr/Cdr.h>
#include <fastdds/dds/domain/DomainParticipant.hpp>
#include <fastdds/dds/domain/DomainParticipantFactory.hpp>
#include <fastdds/dds/publisher/DataWriter.hpp>
#include <fastdds/dds/publisher/Publisher.hpp>
#include <fastdds/dds/subscriber/DataReader.hpp>
#include <fastdds/dds/subscriber/SampleInfo.hpp>
#include <fastdds/dds/subscriber/Subscriber.hpp>
#include <fastdds/dds/topic/TopicDataType.hpp>
#include <fastrtps/utils/IPLocator.h>

#include <array>
#include <chrono>
#include <cstdlib>
#include <string>
#include <thread>

using namespace eprosima::fastdds::dds;
using eprosima::fastcdr::Cdr;
using eprosima::fastcdr::FastBuffer;
using eprosima::fastrtps::rtps::InstanceHandle_t;
using eprosima::fastrtps::rtps::SerializedPayload_t;

struct Twist {
    std::array<double, 6> numbers{};
    void write(Cdr &out) const { out << numbers; }
    void read(Cdr &in) { in >> numbers; }
    static const char *name() { return "geometry_msgs::msg::dds_::Twist_"; }
};

struct Odometry {
    int32_t seconds = 7;
    uint32_t nanoseconds = 0;
    std::string frame = "odom", child = "base_link";
    std::array<double, 7> pose{};
    std::array<double, 36> pose_covariance{}, twist_covariance{};
    std::array<double, 6> twist{};
    void write(Cdr &out) const
    {
        out << seconds << nanoseconds << frame << child << pose << pose_covariance << twist
            << twist_covariance;
    }
    void read(Cdr &in)
    {
        in >> seconds >> nanoseconds >> frame >> child >> pose >> pose_covariance >> twist
            >> twist_covariance;
    }
    static const char *name() { return "nav_msgs::msg::dds_::Odometry_"; }
};

template <typename Message> class Type : public TopicDataType {
public:
    Type()
    {
        setName(Message::name());
        m_typeSize = 1024;
        m_isGetKeyDefined = false;
    }
    bool serialize(void *data, SerializedPayload_t *payload) override
    {
        FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->max_size);
        Cdr out(buffer, Cdr::LITTLE_ENDIANNESS, Cdr::DDS_CDR);
        payload->encapsulation = CDR_LE;
        out.serialize_encapsulation();
        static_cast<Message *>(data)->write(out);
        payload->length = static_cast<uint32_t>(out.getSerializedDataLength());
        return true;
    }
    bool deserialize(SerializedPayload_t *payload, void *data) override
    {
        FastBuffer buffer(reinterpret_cast<char *>(payload->data), payload->length);
        Cdr in(buffer, Cdr::DEFAULT_ENDIAN, Cdr::DDS_CDR);
        in.read_encapsulation();
        static_cast<Message *>(data)->read(in);
        return true;
    }
    std::function<uint32_t()> getSerializedSizeProvider(void *) override
    {
        return [] { return 1024u; };
    }
    void *createData() override { return new Message; }
    void deleteData(void *data) override { delete static_cast<Message *>(data); }
    bool getKey(void *, InstanceHandle_t *, bool) override { return false; }
};

int main(int count, char **words)
{
    if (count != 2)
        return 2;
    DomainParticipantQos quality;
    eprosima::fastrtps::rtps::Locator_t here;
    eprosima::fastrtps::rtps::IPLocator::setIPv4(here, 127, 0, 0, 1);
    quality.wire_protocol().builtin.initialPeersList.push_back(here);
    DomainParticipant *node =
        DomainParticipantFactory::get_instance()->create_participant(std::atoi(words[1]), quality);
    if (node == nullptr)
        return 1;
    TypeSupport twist(new Type<Twist>), odometry(new Type<Odometry>);
    twist.register_type(node);
    odometry.register_type(node);
    Topic *commands = node->create_topic("rt/robot1/cmd_vel", Twist::name(), TOPIC_QOS_DEFAULT);
    Topic *ways = node->create_topic("rt/robot1/odom", Odometry::name(), TOPIC_QOS_DEFAULT);
    DataReaderQos listening;
    listening.reliability().kind = RELIABLE_RELIABILITY_QOS;
    DataReader *reader =
        node->create_subscriber(SUBSCRIBER_QOS_DEFAULT)->create_datareader(commands, listening);
    DataWriter *writer = node->create_publisher(PUBLISHER_QOS_DEFAULT)
                             ->create_datawriter(ways, DATAWRITER_QOS_DEFAULT);
    if (reader == nullptr || writer == nullptr)
        return 1;
    for (uint32_t number = 1;;) {
        Twist told;
        SampleInfo info;
        if (reader->take_next_sample(&told, &info) != ReturnCode_t::RETCODE_OK) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
            continue;
        }
        if (!info.valid_data)
            continue;
        Odometry answer;
        answer.nanoseconds = number++;
        const auto &n = told.numbers;
        answer.pose = {n[0], n[1], n[2], n[3], n[4], n[5], 1.0};
        answer.twist = n;
        for (int k = 0; k < 36; k++) {
            answer.pose_covariance[k] = n[0] * k;
            answer.twist_covariance[k] = n[5] - k;
        }
        writer->write(&answer);
    }
}
