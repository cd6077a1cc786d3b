"""The tables of the store. What a table of an older version lacks is added by service/store/migrations.

Times are text, ISO 8601 in UTC with microseconds (`2017-05-03T09:00:00.000000Z`): they sort as text on every database.
Nothing is deleted: a campaign is withdrawn, corrected or put away, a recording excluded, a skin joined to another or
put away, a model withdrawn, each with who, when and why, and the rows stay.
"""

from typing import Any, TypeAlias

from sqlalchemy import (
    JSON,
    BigInteger,
    Column,
    Float,
    ForeignKey,
    Index,
    Integer,
    LargeBinary,
    MetaData,
    Row,
    String,
    Table,
    Text,
    UniqueConstraint,
)

AnyRow: TypeAlias = Row[*tuple[Any, ...]]

metadata = MetaData()

_Number = BigInteger().with_variant(Integer(), "sqlite")  # SQLite counts up only what it calls INTEGER

skins = Table(
    "skins",
    metadata,
    Column("id", String, primary_key=True),
    Column(
        "root_id", String, ForeignKey("skins.id"), nullable=False, index=True
    ),  # itself, or the skin to which it was joined
    Column("created_at", String, nullable=False),
    Column("joined_to", String, ForeignKey("skins.id")),
    Column("joined_at", String),
    Column("join_reason", Text),
    Column("joined_from", Text),  # name of the API key, else as typed on a page
    Column("title", Text),  # the lab's name for it besides its id
    Column("remark", Text),
    Column("tags", Text),  # with commas between them
    Column("discarded_at", String),  # in no list from then on, until a campaign of it arrives
)

rigs = Table(
    "rigs",
    metadata,
    Column("number", _Number, primary_key=True),
    Column("skin_id", String, ForeignKey("skins.id"), nullable=False),
    Column("document", Text, nullable=False),  # rig/1 as JSON
    Column("created_at", String, nullable=False),
    Index("rigs_of_skin", "skin_id", "number"),
)

# Rig descriptions by the instrument whose files they read; rows are added, never altered.
instrument_templates = Table(
    "instrument_templates",
    metadata,
    Column("number", _Number, primary_key=True),
    Column("instrument", String, nullable=False),  # digest, by service/ingest/instruments.py
    Column("document", Text, nullable=False),  # rig/1 as JSON, without values of a skin or of one recording
    Column("kept_at", String, nullable=False),
    Column("kept_from", Text),  # name of the API key
    Index("templates_of_instrument", "instrument", "number"),
)

campaigns = Table(
    "campaigns",
    metadata,
    Column("number", _Number, primary_key=True),  # the order of arrival
    Column("id", String, nullable=False, unique=True),
    Column("skin_id", String, ForeignKey("skins.id"), nullable=False),
    Column("name", Text, nullable=False),
    Column("about", JSON, nullable=False),  # the campaign document without its recordings
    Column("notes", JSON, nullable=False),  # the reader's notes, a list of texts
    Column("refused", JSON, nullable=False),  # rejected recordings with their errors
    Column("source", Text),  # the name of the file that it came in
    Column("received_at", String, nullable=False),
    Column("received_from", Text),  # name of the API key
    Column("recorded_at", String),  # of the earliest recording that says so
    Column("recordings", Integer, nullable=False),
    Column("excluded", Integer, nullable=False),
    Column("revision", Integer, nullable=False),  # number of changes since it arrived
    Column("corrects", String),  # id of the campaign that this one replaces
    Column("correct_reason", Text),
    Column("corrected_by", String),  # id of the campaign that replaces this one
    Column("withdrawn_at", String),
    Column("withdraw_reason", Text),
    Column("withdrawn_from", Text),  # name of the API key, else as typed on a page
    Column("remark", Text),
    Column("tags", Text),  # with commas between them
    Column("discarded_at", String),  # in no list from then on; withdrawn as well
    Index("campaigns_of_skin", "skin_id", "number"),
)

recordings = Table(
    "recordings",
    metadata,
    Column("campaign", _Number, ForeignKey("campaigns.number"), primary_key=True),
    Column("position", Integer, primary_key=True),  # in the campaign document
    Column("id", Text, nullable=False),
    Column("kind", String, nullable=False),
    Column("sensor", Text),
    Column("recorded_at", String),
    Column("excluded_at", String),
    Column("exclude_reason", Text),
    Column("excluded_from", Text),  # name of the API key, else as typed on a page
    Column("scalars", JSON, nullable=False),  # the recording's document without its arrays
    Column("arrays", LargeBinary, nullable=False),  # service/store/codec.py; last, so that lists never read it
    UniqueConstraint("campaign", "id", name="recording_of_campaign"),
)

# Every change of stored data, by service/store/changes.py; rows are added, never altered.
changes = Table(
    "changes",
    metadata,
    Column("number", _Number, primary_key=True),  # the order of the changes
    Column("id", String, nullable=False, unique=True),
    Column("action", String, nullable=False),
    Column("skin_id", String, ForeignKey("skins.id"), nullable=False),
    Column("campaign_id", String),  # null for a change of the skin itself
    Column("recording", Text),
    Column("at", String, nullable=False),
    Column("made_from", Text),  # name of the API key, else as typed on a page
    Column("reason", Text),
    Column("before", JSON, nullable=False),  # columns by name
    Column("after", JSON, nullable=False),
    Column("undoes", String),  # id of the change that it takes back
    Index("changes_of_skin", "skin_id", "number"),
    Index("changes_of_campaign", "campaign_id", "number"),
)

# Derived from a recording's content: identical ones have the same (underskin.recordings.reading).
recording_digests = Table(
    "recording_digests",
    metadata,
    Column("campaign", _Number, ForeignKey("campaigns.number"), primary_key=True),
    Column("position", Integer, primary_key=True),  # as in `recordings`
    Column("digest", String, nullable=False),
    Index("recordings_by_digest", "digest"),
    sqlite_with_rowid=False,
)

# Derived from a campaign at one revision, with one table of σ, by one version of the answer; computed again when any of
# them has changed.
inversions = Table(
    "inversions",
    metadata,
    Column("campaign", _Number, ForeignKey("campaigns.number"), primary_key=True),
    Column("revision", Integer, nullable=False),
    Column("table_sha256", String, nullable=False),
    Column("document", LargeBinary, nullable=False),  # the answer of /v1/campaigns/{id}/d33, compressed JSON
    # service.schemas.campaign_d33.ANSWER_VERSION
    Column("answer_version", Integer, nullable=False, server_default="0"),
    # service.usecases.figure_data, compressed JSON; null if an earlier underskin stored it
    Column("numbers", LargeBinary),
)

sensor_d33 = Table(
    "sensor_d33",
    metadata,
    Column("campaign", _Number, ForeignKey("campaigns.number"), primary_key=True),
    Column("sensor", String, primary_key=True),
    Column("d33_pc_per_n", Float, nullable=False),
    Column("d33_uncertainty_pc_per_n", Float, nullable=False),
    sqlite_with_rowid=False,
)

# One diagnosis of a campaign with `excluded` of its recordings left out, those that were excluded first: their number
# says which, since an exclusion is taken back only while nothing was diagnosed after it. One of several campaigns has
# them in `diagnosed_campaigns`, the latest of them in `campaign`, and in `excluded` how many recordings of all of them
# are left out.
diagnoses = Table(
    "diagnoses",
    metadata,
    Column("number", _Number, primary_key=True),  # the order in which they are run
    Column("id", String, nullable=False, unique=True),
    Column("campaign", _Number, ForeignKey("campaigns.number"), nullable=False),
    Column("excluded", Integer, nullable=False),
    Column("table_sha256", String, nullable=False),
    Column("version", String, nullable=False),  # of underskin
    Column("without", Text, nullable=False, server_default="[]"),  # JSON list of mechanisms that it leaves out
    Column("own_sha256", String, nullable=False, server_default=""),  # of the lab's own mechanisms; empty for none
    Column("kind", String, nullable=False, server_default="campaign"),  # campaign, skin or fleet
    Column("name", Text),  # the name of its report; null for one of a single campaign
    # of joint diagnoses (service/store/diagnosed_together.py); empty for a single campaign
    Column("together_sha256", String, nullable=False, server_default=""),
    Column("state", String, nullable=False),
    Column("progress", Float, nullable=False),  # 0 to 1
    Column("asked_at", String, nullable=False),
    Column("asked_from", Text),  # name of the API key
    Column("started_at", String),
    Column("ended_at", String),
    Column("reason", Text),  # why it failed
    Column("claimed_by", String),  # the server that runs it
    Column("alive_at", Float),  # when that server last said so [s, by the database's clock]
    Column("verdict", String),
    Column("probability", Float),
    Column("report", LargeBinary),  # report/1, compressed JSON; it and the next last, so that lists never read them
    Column("figures", LargeBinary),  # plotly's JSON of each figure by name, compressed; none where made elsewhere
    Index("diagnoses_of_campaign", "campaign", "number"),
    Index("diagnoses_by_state", "state", "number"),
)

# The campaigns of a diagnosis of several.
diagnosed_campaigns = Table(
    "diagnosed_campaigns",
    metadata,
    Column("diagnosis", _Number, ForeignKey("diagnoses.number"), primary_key=True),
    Column("position", Integer, primary_key=True),  # by skin, then by arrival
    Column("campaign", _Number, ForeignKey("campaigns.number"), nullable=False),
    Column("skin_id", String, ForeignKey("skins.id"), nullable=False),  # the skin that was asked for
    Column("excluded", Integer, nullable=False),  # as in `diagnoses`, of this campaign
    Index("diagnosed_together_with", "campaign", "diagnosis"),
)

# The skins of which a diagnosis of several campaigns has all that there were; none where campaigns were chosen.
diagnosed_skins = Table(
    "diagnosed_skins",
    metadata,
    Column("diagnosis", _Number, ForeignKey("diagnoses.number"), primary_key=True),
    Column("skin_id", String, ForeignKey("skins.id"), primary_key=True),
)

# As `inversions`, under the model that was adopted for the skin; one a campaign, of the model asked for last.
adopted_inversions = Table(
    "adopted_inversions",
    metadata,
    Column("campaign", _Number, ForeignKey("campaigns.number"), primary_key=True),
    Column("model_id", String, nullable=False),
    Column("revision", Integer, nullable=False),
    Column("table_sha256", String, nullable=False),
    Column("answer_version", Integer, nullable=False),  # service.schemas.campaign_d33.ANSWER_VERSION
    Column("document", LargeBinary, nullable=False),  # compressed JSON
)

# Models of skins, one a diagnosis that was adopted; the last one is in force, unless it was withdrawn.
models = Table(
    "models",
    metadata,
    Column("number", _Number, primary_key=True),  # the order of adoption
    Column("id", String, nullable=False, unique=True),
    Column("skin_id", String, ForeignKey("skins.id"), nullable=False),
    Column("version", Integer, nullable=False),  # counts those of the skin
    Column("diagnosis", _Number, ForeignKey("diagnoses.number"), nullable=False),
    Column("adopted_at", String, nullable=False),
    Column("adopted_from", Text),  # name of the API key
    Column("withdrawn_at", String),
    Column("withdrawn_from", Text),  # name of the API key, else as typed on a page
    Column("withdraw_reason", Text),
    UniqueConstraint("skin_id", "version", name="version_of_skin"),
)

# Whether requests need a key. At most one row; none where no key was ever made.
key_requirement = Table(
    "key_requirement",
    metadata,
    Column("number", Integer, primary_key=True, autoincrement=False),
    Column("needed_since", String, nullable=False),
    Column("lifted_at", String),  # by `underskin key open`; null while keys are needed
)

# Logins of browsers. The cookie is not stored: a session is valid by its signature until it expires or is ended here.
sessions = Table(
    "sessions",
    metadata,
    Column("id", String, primary_key=True),
    Column("key_name", Text, nullable=False),
    Column("key_sha256", String, nullable=False),
    Column("address", String, nullable=False),
    Column("browser", Text, nullable=False),
    Column("started_at", String, nullable=False),
    Column("expires_at", String, nullable=False),
    Column("ended_at", String),
)

# Files of the lab's own mechanisms, as they were at the last backup: the folder of UNDERSKIN_MECHANISMS is what counts.
own_mechanisms = Table(
    "own_mechanisms",
    metadata,
    Column("file", String, primary_key=True),
    Column("content", LargeBinary, nullable=False),
)

# What was answered to a POST that carried an Idempotency-Key.
answers = Table(
    "answers",
    metadata,
    Column("sender", String, primary_key=True),  # name of the API key, or empty
    Column("idempotency_key", String, primary_key=True),
    Column("request_sha256", String, nullable=False),
    Column("answer", LargeBinary, nullable=False),  # compressed JSON
    Column("answered_at", String, nullable=False),
    sqlite_with_rowid=False,
)
