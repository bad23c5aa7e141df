"""The campaign and its raw files (docs/campaign.md, docs/formats.md)."""

from vinesexp.public_names import lazy

__all__, __getattr__, __dir__ = lazy(
    __name__,
    {
        "load_campaign": "vinesexp.records.campaign",
        "campaign_problems": "vinesexp.records.campaign",
        "Campaign": "vinesexp.records.schema",
        "Record": "vinesexp.records.schema",
        "read_file": "vinesexp.records.single_file",
        "open_record": "vinesexp.records.store",
        "open_dataset": "vinesexp.records.store",
    },
)
