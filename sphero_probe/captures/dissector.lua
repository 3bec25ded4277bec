-- A Wireshark dissector for the packets of Sphero robots, V1 and V2.
-- Made by sphero-probe; make it again after an update, and do not edit it.
--
-- Use: wireshark -X lua_script:sphero.lua FILE, or copy it into the folder of personal Lua plugins
-- (Help > About Wireshark > Folders).
--
-- The characteristics of the robots are read where discovery is in the capture. Where it is not, choose
-- sphero_v2, sphero_v1_command or sphero_v1_response for the handle in "Decode As". A serial line is read in
-- captures of link types 250 (RTAC Serial) and 147 (USER0). Several serial interfaces in one file are kept apart by
-- tshark in one pass only: elsewhere Wireshark does not tell the interface, so write one file for each line.
--
-- In captures from the air, a packet that was sent again is shown again: Wireshark hands both on. The filter
-- !btle.retransmit leaves the second one out.

local catalogue = {}
--@CATALOGUE@

local SOP, EOP, ESC = 0x8D, 0xD8, 0xAB
local UNDONE = { [0x05] = 0x8D, [0x50] = 0xD8, [0x23] = 0xAB }
local MAX_FRAME = catalogue.max_frame
local NOTIFICATION_SEQ = catalogue.v2.notification_seq

local sphero = Proto("sphero", "Sphero robot")
local sphero_v2 = Proto("sphero_v2", "Sphero V2 characteristic")
local sphero_v1_command = Proto("sphero_v1_command", "Sphero V1 command characteristic")
local sphero_v1_response = Proto("sphero_v1_response", "Sphero V1 response characteristic")
local sphero_serial = Proto("sphero_serial", "Sphero serial line")
local sphero_bare = Proto("sphero_bare", "Sphero serial line without a header")

local f = {
    generation = ProtoField.uint8("sphero.generation", "Generation"),
    kind = ProtoField.string("sphero.kind", "Kind"),
    command = ProtoField.string("sphero.command", "Command"),
    frame = ProtoField.bytes("sphero.frame", "Frame"),
    flags = ProtoField.uint8("sphero.flags", "Flags", base.HEX),
    extended_flags = ProtoField.uint8("sphero.flags.second", "Second flags", base.HEX),
    sop2 = ProtoField.uint8("sphero.sop2", "SOP2", base.HEX),
    target = ProtoField.uint8("sphero.target", "Target", base.HEX),
    source = ProtoField.uint8("sphero.source", "Source", base.HEX),
    did = ProtoField.uint8("sphero.did", "Device id", base.HEX),
    cid = ProtoField.uint8("sphero.cid", "Command id", base.HEX),
    seq = ProtoField.uint8("sphero.seq", "Sequence number"),
    code = ProtoField.uint8("sphero.code", "Response code", base.HEX),
    code_name = ProtoField.string("sphero.code.name", "Response code name"),
    length = ProtoField.uint16("sphero.length", "Length"),
    payload = ProtoField.bytes("sphero.payload", "Payload"),
    field = ProtoField.string("sphero.payload.field", "Field"),
    checksum = ProtoField.uint8("sphero.checksum", "Checksum", base.HEX),
    checksum_ok = ProtoField.bool("sphero.checksum.ok", "Checksum fits"),
    reason = ProtoField.string("sphero.malformed", "Malformed"),
    response_in = ProtoField.framenum("sphero.response_in", "Response in", base.NONE, frametype.RESPONSE),
    response_to = ProtoField.framenum("sphero.response_to", "Response to", base.NONE, frametype.REQUEST),
    time = ProtoField.relative_time("sphero.time", "Time since the command"),
    part = ProtoField.bytes("sphero.part", "Part of a frame"),
}
local all_fields = {}
for _, field in pairs(f) do
    all_fields[#all_fields + 1] = field
end
local function flag_fields(prefix, names)
    local made = {}
    for bit, name in ipairs(names) do
        made[bit] = ProtoField.bool(prefix .. name, name, 8, nil, 2 ^ (bit - 1))
        all_fields[#all_fields + 1] = made[bit]
    end
    return made
end
local v2_flags = flag_fields("sphero.flags.", catalogue.v2.flags)
local v1_flags = flag_fields("sphero.sop2.", catalogue.v1.flags)
sphero.fields = all_fields

local e_malformed = ProtoExpert.new("sphero.malformed.expert", "Malformed", expert.group.MALFORMED, expert.severity.ERROR)
local e_code = ProtoExpert.new("sphero.code.expert", "The robot did not accept the command",
    expert.group.RESPONSE_CODE, expert.severity.NOTE)
local e_unknown = ProtoExpert.new("sphero.unknown.expert", "Not in the catalogue",
    expert.group.UNDECODED, expert.severity.NOTE)
sphero.experts = { e_malformed, e_code, e_unknown }

-- Streams: what each direction of each connection left unfinished, and what each packet completed.

local unfinished, completed, asked

function sphero.init()
    unfinished, completed, asked = {}, {}, {}
end

local function has(flags, mask)
    return math.floor(flags / mask) % 2 == 1
end

local function sum_of(text, first, last)
    local sum = 0
    for at = first, last do
        sum = sum + text:byte(at)
    end
    return sum
end

local function expected_checksum(text, first, last)
    return (255 - sum_of(text, first, last) % 256) % 256
end

local function malformed(raw, reason)
    return { raw = raw, reason = reason }
end

local function checksum_reason(found, expected)
    return string.format("checksum 0x%02x, expected 0x%02x", found, expected)
end

-- V2

local function v2_packet(raw, to_robot)
    local plain, at, last = {}, 2, #raw - 1
    while at <= last do
        local byte = raw:byte(at)
        if byte == ESC then
            local follower = at < last and raw:byte(at + 1) or nil
            if follower == nil then
                return malformed(raw, "escape ab at the end of the frame")
            end
            byte = UNDONE[follower]
            if byte == nil then
                return malformed(raw, string.format("illegal escape ab %02x", follower))
            end
            at = at + 1
        end
        plain[#plain + 1] = string.char(byte)
        at = at + 1
    end
    local body = table.concat(plain)
    if #body == 0 then
        return malformed(raw, "empty frame")
    end
    local expected = expected_checksum(body, 1, #body - 1)
    if body:byte(-1) ~= expected then
        return malformed(raw, checksum_reason(body:byte(-1), expected))
    end
    local flags = body:byte(1)
    local response = has(flags, catalogue.v2.is_response)
    local header = 4
    for _, mask in ipairs({ catalogue.v2.is_response, catalogue.v2.has_target, catalogue.v2.has_source }) do
        header = header + (has(flags, mask) and 1 or 0)
    end
    local second = has(flags, catalogue.v2.extended) and #body > 1
    if #body - (second and 1 or 0) <= header then
        return malformed(raw, string.format("too short: flags 0x%02x want %d bytes, here are %d", flags,
            header + 1, #body - (second and 1 or 0)))
    end
    local packet = { raw = raw, generation = 2, plain = string.char(SOP) .. body .. string.char(EOP), flags = flags }
    local cursor = 2
    local function take(name, present)
        if present then
            packet[name], packet[name .. "_at"] = body:byte(cursor), cursor
            cursor = cursor + 1
        end
    end
    take("second", second)
    take("target", has(flags, catalogue.v2.has_target))
    take("source", has(flags, catalogue.v2.has_source))
    take("did", true)
    take("cid", true)
    take("seq", true)
    take("code", response)
    packet.payload_at, packet.payload = cursor, body:sub(cursor, #body - 1)
    if response then
        packet.kind = "response"
    elseif to_robot == false then
        packet.kind = "notification"
    elseif to_robot == nil and packet.seq == NOTIFICATION_SEQ and not has(flags, catalogue.v2.requests_response) then
        packet.kind = "notification"
    else
        packet.kind = "command"
    end
    return packet
end

-- Each reader takes the bytes that are not yet read, and gives packets with the offset where each ends in
-- them, and what is left.

local function v2_read(data, to_robot)
    local found, from = {}, 1
    local sop, eop = string.char(SOP), string.char(EOP)
    while true do
        local stop = data:find(eop, from, true)
        if stop == nil then
            break
        end
        local start
        for at = stop - 1, from, -1 do
            if data:byte(at) == SOP then
                start = at
                break
            end
        end
        if start == nil or stop - start + 1 > MAX_FRAME then
            found[#found + 1] = { malformed(data:sub(from, stop), "bytes outside a frame"), stop }
        else
            if start > from then
                local reason = data:byte(from) == SOP and "unfinished frame: another start came first"
                    or "bytes outside a frame"
                found[#found + 1] = { malformed(data:sub(from, start - 1), reason), start - 1 }
            end
            found[#found + 1] = { v2_packet(data:sub(start, stop), to_robot), stop }
        end
        from = stop + 1
    end
    local rest = data:sub(from)
    local start = rest:find(sop, 1, true)
    local kept = start and rest:sub(start) or ""
    if start ~= 1 and #rest > 0 then
        local noise = rest:sub(1, (start or #rest + 1) - 1)
        found[#found + 1] = { malformed(noise, "bytes outside a frame"), from + #noise - 1 }
    end
    if #kept > MAX_FRAME then
        found[#found + 1] = { malformed(kept, "no end of frame within " .. MAX_FRAME .. " bytes"), #data }
        kept = ""
    end
    return found, kept
end

-- V1

local function v1_check(data, at, limit, to_robot)
    -- What begins at a start: "valid", "incomplete" or "invalid", the offset where it ends, and what is wrong.
    if limit - at + 1 < catalogue.v1.min_frame then
        return "incomplete"
    end
    local header, length = 5, data:byte(at + 4)
    if to_robot then
        header, length = 6, data:byte(at + 5)
        local fixed = length == 0xFF and catalogue.v1.fixed[data:byte(at + 2) * 256 + data:byte(at + 3)]
        length = fixed and fixed + 1 or length
    elseif data:byte(at + 1) == 0xFE then
        length = data:byte(at + 3) * 256 + length
    end
    local size = header + length
    if length == 0 then
        return "invalid", at + header - 1, "a length of 0 has no room for the checksum"
    elseif size > MAX_FRAME then
        return "invalid", at + header - 1,
            string.format("a frame of %d bytes, at most %d are waited for", size, MAX_FRAME)
    end
    local stop = at + size - 1
    if stop > limit then
        return "incomplete"
    end
    local expected = expected_checksum(data, at + 2, stop - 1)
    if data:byte(stop) == expected then
        return "valid", stop
    end
    return "invalid", stop, checksum_reason(data:byte(stop), expected)
end

local function v1_packet(raw, to_robot)
    local sop2 = raw:byte(2)
    local packet = { raw = raw, plain = raw, generation = 1, flags = sop2, sop2_at = 1 }
    if to_robot then
        packet.kind = "command"
        packet.did, packet.did_at, packet.cid, packet.cid_at = raw:byte(3), 2, raw:byte(4), 3
        packet.seq, packet.seq_at, packet.length_at, packet.length_size = raw:byte(5), 4, 5, 1
        packet.payload_at, packet.payload = 6, raw:sub(7, #raw - 1)
    elseif sop2 == 0xFE then
        packet.kind = "notification"
        packet.cid, packet.cid_at, packet.length_at, packet.length_size = raw:byte(3), 2, 3, 2
        packet.payload_at, packet.payload = 5, raw:sub(6, #raw - 1)
    else
        packet.kind = "response"
        packet.code, packet.code_at, packet.seq, packet.seq_at = raw:byte(3), 2, raw:byte(4), 3
        packet.length_at, packet.length_size = 4, 1
        packet.payload_at, packet.payload = 5, raw:sub(6, #raw - 1)
    end
    return packet
end

local function v1_start(data, from, upto, to_robot)
    for at = from, upto do
        local sop2 = data:byte(at + 1)
        if data:byte(at) == 0xFF and sop2 and sop2 >= (to_robot and 0xF8 or 0xFE) then
            return at
        end
    end
    return nil
end

local function v1_read(data, to_robot)
    local found, reported, at, reason = {}, 1, 1, nil
    local function report(upto)
        if upto >= reported then
            found[#found + 1] = { malformed(data:sub(reported, upto), reason or "bytes outside a frame"), upto }
        end
        reported, reason = upto + 1, nil
    end
    while true do
        if reason == nil then
            local start = v1_start(data, at, #data, to_robot)
            if start == nil then
                report(data:byte(-1) == 0xFF and reported <= #data and #data - 1 or #data)
                return found, data:sub(reported)
            end
            report(start - 1)
            at = start
        end
        local state, stop, wrong = v1_check(data, at, #data, to_robot)
        if state == "valid" then
            report(at - 1)
            found[#found + 1] = { v1_packet(data:sub(at, stop), to_robot), stop }
            at, reported = stop + 1, stop + 1
        elseif state == "incomplete" or (stop == #data and data:byte(-1) == 0xFF) then
            return found, data:sub(reported)
        else
            reason = reason or wrong
            local inner = v1_start(data, at + 1, stop, to_robot)
            while inner and v1_check(data, inner, stop, to_robot) == "invalid" do
                inner = v1_start(data, inner + 1, stop, to_robot)
            end
            if inner then
                at = inner
            else
                report(stop)
                at = stop + 1
            end
        end
    end
end

-- Requests and responses

local PATIENCE = 10

local function same_node(request, source)
    return source == nil or request.target == nil or request.target % 16 == 0
        or request.target % 16 == source % 16
end

local function pair_up(line, packet, pinfo)
    packet.number, packet.moment = pinfo.number, pinfo.rel_ts
    local key = line .. " " .. (packet.seq or "")
    if packet.generation == 2 then
        key = string.format("%s %d %d", key, packet.did, packet.cid)
    end
    if packet.kind == "command" then
        local wants = packet.generation == 1 and has(packet.flags, 1) or packet.generation == 2
            and has(packet.flags, catalogue.v2.requests_response) and not has(packet.flags, catalogue.v2.only_errors)
        if wants then
            asked[key] = asked[key] or {}
            table.insert(asked[key], packet)
        end
    elseif packet.kind == "response" then
        local waiting = asked[key] or {}
        while waiting[1] and packet.moment - waiting[1].moment > PATIENCE do
            table.remove(waiting, 1)
        end
        for at, request in ipairs(waiting) do
            if same_node(request, packet.source) then
                table.remove(waiting, at)
                packet.request, request.response = request, packet
                packet.seconds = packet.moment - request.moment
                break
            end
        end
    end
end

-- Showing

local function row_of(packet)
    local known = packet.generation == 1 and catalogue.v1 or catalogue.v2
    if packet.generation == 1 and packet.kind == "notification" then
        return known.messages[packet.cid], nil
    end
    local about = packet
    if packet.generation == 1 and packet.kind == "response" then
        about = packet.request
        if about == nil then
            return nil, nil
        end
    end
    local device = known.devices[about.did]
    local pair = about.did * 256 + about.cid
    local row = packet.kind == "notification" and known.notifications[pair] or known.commands[pair]
    return row or known.notifications[pair], device
end

local function number_of(kind, range)
    local unsigned = { u8 = true, u16 = true, u32 = true, bool = true, const = true, uint = range:len() <= 4 }
    if unsigned[kind] then
        return range:uint()
    elseif kind == "f32" then
        return range:float()
    elseif kind == "i8" or kind == "i16" or kind == "i32" then
        return range:int()
    end
    return nil
end

local function value_text(field, range)
    local name, kind, scale, values, unit = field[1], field[2], field[3], field[4], field[5]
    local number = number_of(kind, range)
    local text
    if kind == "bytes" then
        text = tostring(range:bytes()):lower()
    elseif kind == "cstring" then
        local raw = range:raw()
        text = raw:sub(1, (raw:find("\0", 1, true) or #raw + 1) - 1):gsub("[^\32-\126]", function(other)
            return string.format("\\x%02x", other:byte())
        end)
    elseif number == nil then
        text = tostring(range:uint64())
    elseif kind == "bool" and number <= 1 then
        text = number == 1 and "true" or "false"
    elseif values and values.flags then
        local words = {}
        for bit, word in pairs(values.names) do
            if has(number, bit) then
                words[#words + 1] = word
            end
        end
        table.sort(words)
        text = string.format("%s (0x%x)", table.concat(words, ", "), number)
    elseif values and values.names[number] then
        text = string.format("%s (%d)", values.names[number], number)
    elseif scale ~= 1 or kind == "f32" then
        text = string.format("%.6g", number / scale)
    else
        text = string.format("%d", number)
    end
    return name .. ": " .. text .. (unit ~= "" and " " .. unit or "")
end

local function fits(layout, length)
    local least, rest = 0, nil
    for _, field in ipairs(layout) do
        least = least + field.least
        rest = (field.to_end or field.optional) and field or rest
    end
    local surplus = length - least
    if rest == nil then
        return surplus == 0
    elseif rest.optional then
        return surplus == 0 or surplus == rest.size
    elseif rest[2] == "uint" then
        return surplus >= 0 and surplus < 8
    end
    return surplus >= 0 and surplus % rest.width == 0
end

local function show_payload(tree, range, layouts)
    local length = range and range:len() or 0
    for _, layout in ipairs(layouts or {}) do
        if fits(layout, length) then
            local at = 0
            for _, field in ipairs(layout) do
                local blob = field[2] == "bytes" or field[2] == "cstring" or field[2] == "uint"
                local size = field.to_end and length - at or field.size
                if size > 0 and at + size <= length then
                    local width = blob and size or field.width
                    for from = at, field[2] == "const" and -1 or at + size - width, width do
                        local part = range(from, width)
                        tree:add(f.field, part, value_text(field, part)):set_text(value_text(field, part))
                    end
                    at = at + size
                end
            end
            return
        end
    end
end

local function show_flags(tree, range, value, own, fields)
    local item = tree:add(own, range, value)
    for _, field in ipairs(fields) do
        item:add(field, range, value)
    end
end

local function show_malformed(packet, view, tree)
    local item = tree:add(sphero, view(), "Sphero, malformed: " .. packet.reason)
    item:add(f.kind, view(), "malformed"):set_generated()
    item:add(f.frame, view())
    local reason = item:add(f.reason, view(), packet.reason)
    reason:set_generated()
    reason:add_proto_expert_info(e_malformed, packet.reason)
    return "malformed: " .. packet.reason
end

local function show_packet(packet, view, pinfo, tree)
    if packet.reason then
        return show_malformed(packet, view, tree)
    end
    local row, device = row_of(packet)
    local known = packet.generation == 1 and catalogue.v1 or catalogue.v2
    local name = row and row.name
    local code_name = packet.code and (known.codes[packet.code] or "unlisted")
    local title = string.format("%s %s%s", packet.kind, name or "unknown", packet.code and ", " .. code_name or "")
    local item = tree:add(sphero, view(), string.format("Sphero V%d, %s", packet.generation, title))
    item:add(f.generation, view(), packet.generation):set_generated()
    item:add(f.kind, view(), packet.kind):set_generated()
    item:add(f.frame, view()):set_hidden()
    if name then
        item:add(f.command, view(), name):set_generated()
    elseif packet.did or packet.kind == "notification" then
        item:add_proto_expert_info(e_unknown)
    end
    if packet.generation == 2 then
        show_flags(item, view(1, 1), packet.flags, f.flags, v2_flags)
    else
        show_flags(item, view(1, 1), packet.flags, f.sop2, packet.kind == "command" and v1_flags or {})
    end
    if packet.second then
        item:add(f.extended_flags, view(packet.second_at, 1), packet.second)
    end
    for _, side in ipairs({ "target", "source" }) do
        if packet[side] then
            item:add(f[side], view(packet[side .. "_at"], 1), packet[side]):append_text(
                string.format(" (port %d, node %d)", math.floor(packet[side] / 16), packet[side] % 16))
        end
    end
    if packet.code_at and packet.generation == 1 then
        item:add(f.code, view(packet.code_at, 1), packet.code):append_text(" (" .. code_name .. ")")
    end
    if packet.did then
        item:add(f.did, view(packet.did_at, 1), packet.did):append_text(" (" .. (device or "unknown") .. ")")
    end
    if packet.cid then
        item:add(f.cid, view(packet.cid_at, 1), packet.cid):append_text(" (" .. (name or "unknown") .. ")")
    end
    if packet.seq then
        item:add(f.seq, view(packet.seq_at, 1), packet.seq)
    end
    if packet.code_at and packet.generation == 2 then
        item:add(f.code, view(packet.code_at, 1), packet.code):append_text(" (" .. code_name .. ")")
    end
    if packet.code then
        local shown = item:add(f.code_name, view(packet.code_at, 1), code_name)
        shown:set_generated()
        if packet.code ~= 0 then
            shown:add_proto_expert_info(e_code, code_name)
        end
    end
    if packet.length_at then
        item:add(f.length, view(packet.length_at, packet.length_size))
    end
    if #packet.payload > 0 then
        local range = view(packet.payload_at, #packet.payload)
        local payload = item:add(f.payload, range)
        if row and (packet.code or 0) == 0 then
            show_payload(payload, range, packet.kind == "command" and row.request or row.response)
        end
    end
    local checksum_at = packet.payload_at + #packet.payload
    item:add(f.checksum, view(checksum_at, 1))
    item:add(f.checksum_ok, view(checksum_at, 1), true):set_generated()
    if packet.request then
        item:add(f.response_to, view(), packet.request.number):set_generated()
        local whole = math.floor(packet.seconds)
        local time = NSTime.new(whole, math.floor((packet.seconds - whole) * 1e9 + 0.5))
        item:add(f.time, view(), time):set_generated()
    elseif packet.response then
        item:add(f.response_in, view(), packet.response.number):set_generated()
    end
    return title .. (packet.seq and string.format(", seq %d", packet.seq) or "")
end

-- Dissecting

local function read_value(tvb, pinfo, line, direction, read, to_robot)
    local key = string.format("%d %d %s", pinfo.number, tvb:offset(), direction)
    if completed[key] then
        return completed[key]
    end
    local stream = line .. direction
    local before = unfinished[stream] or ""
    local data = before .. tvb:raw(0, tvb:len())
    local found, kept = read(data, to_robot)
    unfinished[stream] = kept
    local shown = { rest = math.min(#kept, tvb:len()) }
    for _, each in ipairs(found) do
        local packet, stop = each[1], each[2]
        local start = stop - #packet.raw - #before
        if not packet.reason then
            pair_up(line, packet, pinfo)
        end
        shown[#shown + 1] = { packet = packet, start = start }
    end
    completed[key] = shown
    return shown
end

local function view_of(packet, start, tvb)
    local plain = packet.plain or packet.raw
    if plain == packet.raw and start >= 0 then
        return tvb(start, #plain):tvb()
    end
    return ByteArray.new(plain, true):tvb(start < 0 and "Reassembled Sphero frame" or "Unescaped Sphero frame")
end

local function dissect(tvb, pinfo, tree, line, read, to_robot)
    local direction = to_robot == nil and " both" or to_robot and " to" or " from"
    local shown = read_value(tvb, pinfo, line, direction, read, to_robot)
    local titles = {}
    for _, each in ipairs(shown) do
        titles[#titles + 1] = show_packet(each.packet, view_of(each.packet, each.start, tvb), pinfo, tree)
    end
    if shown.rest > 0 then
        local range = tvb(tvb:len() - shown.rest, shown.rest)
        tree:add(sphero, range, "Sphero, part of a frame"):add(f.part, range)
        titles[#titles + 1] = "part of a frame"
    end
    if #titles > 0 then
        pinfo.cols.protocol = "Sphero"
        pinfo.cols.info = table.concat(titles, " | ")
    end
    return tvb:len()
end

local function line_of(pinfo)
    local ends = { tostring(pinfo.src), tostring(pinfo.dst) }
    table.sort(ends)
    return table.concat(ends, " ")
end

local function sent(pinfo)
    if pinfo.p2p_dir == 0 then
        return true
    elseif pinfo.p2p_dir == 1 then
        return false
    end
    return nil
end

function sphero_v2.dissector(tvb, pinfo, tree)
    return dissect(tvb, pinfo, tree, "v2 " .. line_of(pinfo), v2_read, sent(pinfo))
end

function sphero_v1_command.dissector(tvb, pinfo, tree)
    return dissect(tvb, pinfo, tree, "v1 " .. line_of(pinfo), v1_read, true)
end

function sphero_v1_response.dissector(tvb, pinfo, tree)
    return dissect(tvb, pinfo, tree, "v1 " .. line_of(pinfo), v1_read, false)
end

local by_uuid = DissectorTable.get("bluetooth.uuid")
by_uuid:add(catalogue.v2.commands_characteristic, sphero_v2)
by_uuid:add(catalogue.v1.commands_characteristic, sphero_v1_command)
by_uuid:add(catalogue.v1.responses_characteristic, sphero_v1_response)
local by_handle = DissectorTable.get("btatt.handle")
for _, each in ipairs({ sphero_v2, sphero_v1_command, sphero_v1_response }) do
    pcall(by_handle.add_for_decode_as, by_handle, each)
end

-- Serial: link type 250 has a header of 12 bytes, which Wireshark's own dissector shows. Link type 147 is the
-- first one for private use: what is not a robot's there is left to the dissector that was chosen for it.

local by_link = DissectorTable.get("wtap_encap")
local rtac = by_link:get_dissector(wtap.RTAC_SERIAL)
local user = by_link:get_dissector(wtap.USER0)
local interface_of = Field.new("frame.interface_id")
local RTAC_HEADER, RTAC_KIND = 12, 8
local RTAC_SENT = { [0x01] = true, [0x02] = false, [0x03] = true, [0x04] = false }

-- V2 or V1? The first record of a line that begins with a valid frame tells; before it, the line is left alone.
local function dissect_serial(data, pinfo, tree, to_robot)
    local interface = interface_of()
    local line = "serial " .. tostring(interface and interface.value or 0)
    local key = line .. (to_robot == nil and " both" or to_robot and " to" or " from") .. " reader"
    local spoken = completed[key]
    if spoken == nil then
        for _, read in ipairs({ v2_read, v1_read }) do
            local found = read(data:raw(0, data:len()), to_robot)
            if found[1] and not found[1][1].reason then
                spoken = read
                break
            end
        end
        if spoken == nil then
            return false
        end
        completed[key] = spoken
    end
    dissect(data, pinfo, tree, line, spoken, to_robot)
    return true
end

function sphero_serial.dissector(tvb, pinfo, tree)
    if rtac then
        rtac:call(tvb, pinfo, tree)
    end
    local to_robot = tvb:len() > RTAC_HEADER and RTAC_SENT[tvb(RTAC_KIND, 1):uint() % 128]
    if tvb:len() > RTAC_HEADER and to_robot ~= nil then
        dissect_serial(tvb(RTAC_HEADER):tvb(), pinfo, tree, to_robot)
    end
    return tvb:len()
end

function sphero_bare.dissector(tvb, pinfo, tree)
    if not dissect_serial(tvb, pinfo, tree, sent(pinfo)) and user then
        user:call(tvb, pinfo, tree)
    end
    return tvb:len()
end

by_link:add(wtap.RTAC_SERIAL, sphero_serial)
by_link:add(wtap.USER0, sphero_bare)
